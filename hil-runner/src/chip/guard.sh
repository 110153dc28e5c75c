# Runs a program in a private folder with two FIFOs, and leaves none of it
# behind: sh guard.sh PARENT-FOLDER PROGRAM ARGUMENT...
#
# Standard input is a pipe that the starter holds and never writes to. When it
# closes, because the starter let go, ended or was killed, the program is
# killed: QEMU in a semihosting call ignores every gentler signal.
# The first line on standard output is the folder. Standard error has what the
# program says. The status is the program's.
umask 077
folder=$(mktemp -d "$1/servo-bench.XXXXXXXX") || exit 125
shift
trap 'rm -rf "$folder"' EXIT
cd "$folder" && mkfifo to-chip from-chip || exit 125

# 3: the starter's pipe; 4: the program's output. Some shells tell of a killed
# child on standard error.
exec 3<&0 </dev/null 4>&2 2>/dev/null
"$@" >&4 2>&4 3<&- 4>&- &
program=$!

# Does its work alone should this script be killed; never with a child of its
# own, which would outlive it.
{
    trap - EXIT
    read -r _ <&3
    kill -9 "$program"
    exec rm -rf "$folder"
} >&- 4>&- &
reader=$!

trap 'kill -9 "$program"' HUP INT TERM
echo "$folder"
exec >&- 3<&- 4>&-
wait "$program"
status=$?
# A signal to this script ends a wait before its time.
while kill -0 "$program"; do
    wait "$program"
    status=$?
done
kill -9 "$reader"
wait "$reader"
exit "$status"
