/* Golden vectors on a Cortex-M4: every row goes into the axis, and what comes out is compared.
 * Built and run in QEMU by scripts/c-example. */
#include "servo.h"

struct row {
  const char *file;
  uint32_t line;
  uint8_t starts; /* the axis anew, with these settings; else it changes to them */
  const servo_settings *settings;
  uint8_t requests, events[3];
  servo_inputs inputs;
  const servo_setpoint *setpoint;
  const servo_stretch *stretch;
  servo_output output; /* and the fault: what must come out */
  const servo_fault *fault;
};
#include "rows.h"
#define ROWS (sizeof rows / sizeof rows[0])

/* Semihosting: the debugger's functions, here QEMU's. */
static int host(int function, const void *argument) {
  register int r0 __asm__("r0") = function;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}
static void print(const char *text) { host(0x04, text); }
static void print_number(uint32_t number) {
  char digits[11], *first = digits + 10;
  *first = 0;
  do *--first = (char)('0' + number % 10); while (number /= 10);
  print(first);
}
static void leave(uint32_t status) {
  const uint32_t reason[2] = {0x20026, status};
  host(0x20, reason);
}

/* SysTick counts down at 25 MHz, 40 ns; under -icount shift=7 an instruction takes 128 ns. */
#define SYSTICK ((volatile uint32_t *)0xe000e010)
static uint32_t ticks;

static bool same_fault(const servo_axis *axis, const servo_fault *b) {
  servo_fault a;
  if (!b || servo_axis_fault(axis, &a) != 1) return !b && servo_axis_fault(axis, &a) == 0;
  return a.tick == b->tick && a.measured == b->measured && a.limit == b->limit &&
         a.setpoint == b->setpoint && a.position == b->position && a.code == b->code &&
         a.error_counts == b->error_counts && a.cause == b->cause;
}

/* Whether the axis gives what the row wants. */
static bool replay(servo_axis *axis, const struct row *row) {
  if (row->settings) {
    int refused = row->starts ? servo_axis_start(axis, row->settings)
                              : servo_axis_change(axis, row->settings);
    if (refused) {
      print(refused > 0 ? servo_settings_name(refused - 1) : "no pointer");
      print(" is refused\n");
      return false;
    }
  }
  for (int i = 0; i < row->requests; i++)
    if (servo_axis_request(axis, row->events[i])) return false;
  servo_motion motion = {row->stretch, 1, 0};
  uint32_t before = SYSTICK[2];
  servo_output o = row->stretch ? servo_axis_play(axis, &row->inputs, &motion)
                                : servo_axis_tick(axis, &row->inputs, row->setpoint);
  ticks += (before - SYSTICK[2]) & 0xffffff;
  const servo_output *w = &row->output;
  return o.code == w->code && o.error_counts == w->error_counts && o.state == w->state &&
         o.power == w->power && o.out_of_range == w->out_of_range && same_fault(axis, row->fault);
}

static int run(void) {
  static servo_axis axis;
  SYSTICK[1] = 0xffffff;
  SYSTICK[0] = 5;
  for (uint32_t i = 0; i < ROWS; i++) {
    if (replay(&axis, &rows[i])) continue;
    print(rows[i].file);
    print(".txt:");
    print_number(rows[i].line);
    print(": the axis gives other outputs\n");
    return 1;
  }
  print_number(ROWS);
  print(" rows of ");
  print_number(FILES);
  print(" files, all equal; ");
  print_number((uint32_t)((uint64_t)ticks * 40 / 128 / ROWS));
  print(" instructions a tick\n");
  return 0;
}

/* Start of the processor: no initial values in RAM, statics at 0. */
extern uint32_t bss_start, bss_end, stack_top;
void reset(void) {
  *(volatile uint32_t *)0xe000ed88 |= 0xf << 20; /* the floating-point unit's registers */
  for (uint32_t *word = &bss_start; word < &bss_end; word++) *word = 0;
  leave((uint32_t)run());
}
static void stop(void) {
  print("a processor's fault\n");
  leave(2);
}
__attribute__((section(".start"), used)) static const void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop};
