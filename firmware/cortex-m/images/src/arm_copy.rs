//! Copies and clears in 60 bytes; the linker drops those that nothing calls.
//!
//! The compiler calls them by these names for values of more than a few
//! words. Its own versions unroll for every alignment and take 3 KiB, two
//! fifths of the flash that the whole controller may have.

use core::arch::global_asm;

// r0 is where to, r1 where from, r2 how many bytes. Words while there are
// some, then bytes. `memcpy` and `memmove` also return r0.
global_asm!(
    ".syntax unified",
    ".thumb",
    ".macro entry name",
    ".global \\name",
    ".type \\name, %function",
    ".thumb_func",
    "\\name:",
    ".endm",
    ".section .text.copy, \"ax\"",
    ".balign 4",
    // Aligned to 4.
    "entry __aeabi_memcpy8",
    "entry __aeabi_memcpy4",
    "1: subs r2, #4",
    "blo 2f",
    "ldmia r1!, {{r3}}",
    "stmia r0!, {{r3}}",
    "b 1b",
    "2: adds r2, #4",
    "entry __aeabi_memcpy",
    "3: subs r2, #1",
    "blo 4f",
    "ldrb r3, [r1]",
    "strb r3, [r0]",
    "adds r1, #1",
    "adds r0, #1",
    "b 3b",
    "4: bx lr",
    ".section .text.copy_for_c, \"ax\"",
    "entry memcpy",
    "push {{r0, lr}}",
    "bl __aeabi_memcpy",
    "pop {{r0, pc}}",
    // Where to and where from may overlap: from the end that is not written
    // first.
    ".section .text.move, \"ax\"",
    "entry __aeabi_memmove8",
    "entry __aeabi_memmove4",
    "entry __aeabi_memmove",
    "entry memmove",
    "push {{r0, lr}}",
    "cmp r0, r1",
    "bhi 5f",
    "bl __aeabi_memcpy",
    "pop {{r0, pc}}",
    "5: subs r2, #1",
    "blo 6f",
    "ldrb r3, [r1, r2]",
    "strb r3, [r0, r2]",
    "b 5b",
    "6: pop {{r0, pc}}",
    // r0 is where to, r1 how many bytes.
    ".section .text.clear, \"ax\"",
    ".balign 4",
    "entry __aeabi_memclr8",
    "entry __aeabi_memclr4",
    "movs r2, #0",
    "7: subs r1, #4",
    "blo 8f",
    "stmia r0!, {{r2}}",
    "b 7b",
    "8: adds r1, #4",
    "entry __aeabi_memclr",
    "movs r2, #0",
    // r2 is the byte.
    "entry __aeabi_memset8",
    "entry __aeabi_memset4",
    "entry __aeabi_memset",
    "9: subs r1, #1",
    "blo 10f",
    "strb r2, [r0]",
    "adds r0, #1",
    "b 9b",
    "10: bx lr",
    ".purgem entry",
);
