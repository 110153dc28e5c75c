//! Copies and clears in 130 bytes.
//!
//! The compiler calls them by these names for values of more than a few
//! words. Its own versions unroll for every alignment and take 3 KiB, two
//! fifths of the flash that the whole controller may have.

use core::arch::global_asm;

// r0 is where to, r1 where from, r2 how many bytes. Words while there are
// some, then bytes. `memcpy` and `memmove` also return r0.
global_asm!(
    ".section .text.copy, \"ax\"",
    ".syntax unified",
    ".thumb",
    ".balign 4",
    ".macro entry name",
    ".global \\name",
    ".type \\name, %function",
    ".thumb_func",
    "\\name:",
    ".endm",
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
    "entry memcpy",
    "push {{r0, lr}}",
    "bl __aeabi_memcpy",
    "pop {{r0, pc}}",
    // Where to and where from may overlap: from the end that is not written
    // first.
    "entry __aeabi_memmove8",
    "entry __aeabi_memmove4",
    "cmp r0, r1",
    "bls __aeabi_memcpy4",
    "b 8f",
    "entry __aeabi_memmove",
    "cmp r0, r1",
    "bls __aeabi_memcpy",
    "8: subs r2, #1",
    "blo 4b",
    "ldrb r3, [r1, r2]",
    "strb r3, [r0, r2]",
    "b 8b",
    "entry memmove",
    "push {{r0, lr}}",
    "bl __aeabi_memmove",
    "pop {{r0, pc}}",
    // r0 is where to, r1 how many bytes.
    "entry __aeabi_memclr8",
    "entry __aeabi_memclr4",
    "movs r2, #0",
    "5: subs r1, #4",
    "blo 6f",
    "stmia r0!, {{r2}}",
    "b 5b",
    "6: adds r1, #4",
    "entry __aeabi_memclr",
    "movs r2, #0",
    // r2 is the byte.
    "entry __aeabi_memset8",
    "entry __aeabi_memset4",
    "entry __aeabi_memset",
    "7: subs r1, #1",
    "blo 4b",
    "strb r2, [r0]",
    "adds r0, #1",
    "b 7b",
    ".purgem entry",
);
