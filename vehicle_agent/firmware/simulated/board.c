// An Arduino Nano in simavr with Nigel around it: a serial line, an encoder on each wheel, an
// IMU, a battery. It tells on stdout what its pins do, a line each: `microseconds name value`.
//
//   board firmware.hex              steps on command: commands come on stdin, a line each
//   board firmware.hex --pty LINK   runs in real time; the serial line is a pseudo-terminal
//
// Commands:  run MS | rx HEX | pin D0..D7 LEVEL | battery MILLIVOLT | imu on|off|stuck
//            reading AX AY AZ GX GY GZ (raw) | hang | pull | plug (the pseudo-terminal) | quit
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_hex.h>

enum { HZ = 16000000, US = HZ / 1000000, MS = HZ / 1000 };
enum { BYTE_US = 200 };  // a little slower than 57600 baud, so that simavr's own queue stays short
enum { IMU_ADDRESS = 0x68, RAM_END = 0x8FF, HANGS_AT = 0x7000 };
// Registers of the ATmega328P, as addresses of its data space.
enum { DDRB = 0x24, PORTB = 0x25, PORTC = 0x28, PORTD = 0x2B, TCCR0A = 0x44, OCR0A = 0x47,
       SPL = 0x5D, TIMSK2 = 0x70, TCCR1A = 0x80, OCR1A = 0x88, OCR2A = 0xB3, TWCR = 0xBC };

static avr_t *avr;
static uint8_t queue[1 << 16];
static unsigned queue_head, queue_tail;
static int pty = -1, pty_far = -1;
static int is_live;
static unsigned lowest_sp = RAM_END;

static unsigned long long now_us(void) { return avr->cycle / US; }

static void report(const char *name, double value) {
    printf("%llu %s %.10g\n", now_us(), name, value);
}

// ---- serial line -------------------------------------------------------------------------

static void on_sent(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    uint8_t byte = value;
    if (!is_live)
        printf("%llu tx %02x\n", now_us(), byte);
    else if (pty >= 0 && write(pty, &byte, 1) < 0 && errno != EAGAIN && errno != EIO)
        perror("board: pty");
}

static void deliver(void) {
    static avr_cycle_count_t next;
    if (queue_head == queue_tail || avr->cycle < next) return;
    next = avr->cycle + BYTE_US * US;
    avr_irq_t *in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_raise_irq(in, queue[queue_head++ % sizeof queue]);
    if (queue_head == queue_tail) report("received", queue_head);
}

static void receive(uint8_t byte) {
    if (queue_tail - queue_head < sizeof queue) queue[queue_tail++ % sizeof queue] = byte;
}

// ---- the IMU: registers behind an address --------------------------------------------------

static struct {
    uint8_t reg[128], at, is_here, is_chosen, is_first;
} imu;

static void imu_reset(void) {
    memset(&imu.reg, 0, sizeof imu.reg);
    imu.reg[0x75] = 0x71;
    imu.reg[0x6B] = 0x40;
}

static void on_twi(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    avr_twi_msg_irq_t message = {.u.v = value};
    avr_irq_t *answer = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT);
    if (message.u.twi.msg & TWI_COND_STOP) imu.is_chosen = 0;
    if (message.u.twi.msg & TWI_COND_START) {
        imu.is_chosen = imu.is_here && message.u.twi.addr >> 1 == IMU_ADDRESS;
        imu.is_first = 1;
        if (imu.is_chosen)
            avr_raise_irq(answer, avr_twi_irq_msg(TWI_COND_ACK, message.u.twi.addr, 1));
    }
    if (!imu.is_chosen) return;
    if (message.u.twi.msg & TWI_COND_WRITE) {
        avr_raise_irq(answer, avr_twi_irq_msg(TWI_COND_ACK, message.u.twi.addr, 1));
        if (imu.is_first)
            imu.at = message.u.twi.data & 127;
        else
            imu.reg[imu.at++ & 127] = message.u.twi.data;
        imu.is_first = 0;
    }
    if (message.u.twi.msg & TWI_COND_READ) {
        // Its readings stay zero while it sleeps (bit 6 of register 0x6B).
        uint8_t is_asleep = imu.reg[0x6B] & 0x40 && imu.at >= 0x3B && imu.at <= 0x48;
        uint8_t data = is_asleep ? 0 : imu.reg[imu.at & 127];
        imu.at++;
        avr_raise_irq(answer, avr_twi_irq_msg(TWI_COND_READ, message.u.twi.addr, data));
    }
}

static avr_io_write_t twi_control;

// A bus on which no step is ever done: the control register takes what is written, no more.
static void on_stuck_twi(avr_t *a, avr_io_addr_t addr, uint8_t v, void *param) {
    (void)param;
    a->data[addr] = v & 0x7F;
}

static void set_imu(const char *how) {
    avr_io_write_t *control = &avr->io[AVR_DATA_TO_IO(TWCR)].w.c;
    if (twi_control == NULL) twi_control = *control;
    *control = strcmp(how, "stuck") == 0 ? on_stuck_twi : twi_control;
    imu.is_here = strcmp(how, "on") == 0;
    imu_reset();
}

static void set_readings(const char *text) {
    int v[6];
    if (sscanf(text, "%d %d %d %d %d %d", v, v + 1, v + 2, v + 3, v + 4, v + 5) != 6) return;
    for (int i = 0; i < 6; ++i) {
        int at = 0x3B + 2 * i + (i > 2 ? 2 : 0);  // the temperature lies between
        imu.reg[at] = v[i] >> 8;
        imu.reg[at + 1] = v[i];
    }
}

// ---- what the pins do ----------------------------------------------------------------------

static int bit(int address, int number) { return avr->data[address] >> number & 1; }

static int motor_duty(void) {
    return bit(TCCR0A, 7) ? avr->data[OCR0A] : 255 * bit(PORTD, 6);
}

// The registers' word and not the pin's: simavr moves that one with every write to its port.
static double servo_us(void) {
    int is_pulsed = bit(TCCR1A, 7) && bit(DDRB, 1);
    return is_pulsed ? ((avr->data[OCR1A] | avr->data[OCR1A + 1] << 8) + 1) * 0.5 : 0;
}

static int tail_duty(void) {
    return avr->data[TIMSK2] ? avr->data[OCR2A] : 255 * bit(PORTB, 2);
}

static struct {
    const char *name;
    int port, number, last;
} pins[] = {{"dir", PORTD, 7, 0},  {"brake", PORTB, 0, 0},   {"low_beam", PORTB, 3, 0},
            {"high_beam", PORTB, 4, 0}, {"reverse", PORTB, 5, 0}, {"left", PORTC, 0, 0},
            {"right", PORTC, 1, 0}};

static void watch(void) {
    static int last_duty, last_tail;
    static double last_us, before_us;
    int duty = motor_duty(), tail = tail_duty();
    double width_us = servo_us();
    // Written in two halves, it counts once it stands.
    if (width_us != last_us && width_us == before_us) report("servo_us", last_us = width_us);
    before_us = width_us;
    if (duty != last_duty) report("pwm", last_duty = duty);
    if (tail != last_tail) report("tail", last_tail = tail);
    for (unsigned i = 0; i < sizeof pins / sizeof *pins; ++i) {
        int level = bit(pins[i].port, pins[i].number);
        if (level != pins[i].last) report(pins[i].name, pins[i].last = level);
    }
    unsigned sp = avr->data[SPL] | avr->data[SPL + 1] << 8;
    if (sp > 0x100 && sp < lowest_sp) lowest_sp = sp;
}

static void run_until(avr_cycle_count_t end) {
    while (avr->cycle < end) {
        deliver();
        int state = avr_run(avr);
        watch();
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "board: the processor stopped, state %d\n", state);
            exit(3);
        }
    }
}

// ---- the pseudo-terminal -----------------------------------------------------------------------

static const char *link_path;

static void pull(void) {
    if (pty < 0) return;
    unlink(link_path);
    close(pty_far);
    close(pty);
    pty = -1;
}

static void leave(int number) {
    (void)number;
    unlink(link_path);
    _exit(0);
}

static void plug(void) {
    if (pty >= 0 || link_path == NULL) return;
    char name[64];
    if (openpty(&pty, &pty_far, name, NULL, NULL) < 0) {
        perror("board: openpty");
        exit(1);
    }
    struct termios raw;
    tcgetattr(pty_far, &raw);
    cfmakeraw(&raw);
    tcsetattr(pty_far, TCSANOW, &raw);
    fcntl(pty, F_SETFL, O_NONBLOCK);
    unlink(link_path);
    if (symlink(name, link_path) < 0) {
        perror(link_path);
        exit(1);
    }
    signal(SIGTERM, leave);
    signal(SIGINT, leave);
}

// ---- commands ------------------------------------------------------------------------------

static void receive_hex(const char *hex) {
    unsigned byte;
    for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) receive(byte);
}

// Drive an input pin from outside, for good: each write to the port would pull it up again.
static void set_pin(const char *text) {
    static avr_ioport_external_t outside = {.name = 'D'};
    int number, level;
    if (sscanf(text, "%d %d", &number, &level) != 2 || number < 0 || number > 7) return;
    outside.mask |= 1 << number;
    outside.value = (outside.value & ~(1 << number)) | (level != 0) << number;
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &outside);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), number), level);
}

static int obey(char *line) {
    line[strcspn(line, "\n")] = 0;
    char *rest = strchr(line, ' ');
    rest = rest ? (*rest = 0, rest + 1) : line + strlen(line);
    if (strcmp(line, "run") == 0)
        run_until(avr->cycle + (avr_cycle_count_t)(atof(rest) * MS));
    else if (strcmp(line, "rx") == 0)
        receive_hex(rest);
    else if (strcmp(line, "pin") == 0)
        set_pin(rest);
    else if (strcmp(line, "battery") == 0)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC2), atoi(rest));
    else if (strcmp(line, "imu") == 0)
        set_imu(rest);
    else if (strcmp(line, "reading") == 0)
        set_readings(rest);
    else if (strcmp(line, "hang") == 0)
        avr->pc = HANGS_AT;
    else if (strcmp(line, "pull") == 0)
        pull();
    else if (strcmp(line, "plug") == 0)
        plug();
    else if (strcmp(line, "quit") == 0)
        return 0;
    else
        fprintf(stderr, "board: unknown command: %s\n", line);
    report("ok", RAM_END - lowest_sp);
    fflush(stdout);
    return 1;
}

// ---- the two ways to run ------------------------------------------------------------------

static void run_stepped(void) {
    static char line[1 << 17];
    while (fgets(line, sizeof line, stdin) && obey(line)) {
    }
}

static void run_live(void) {
    plug();
    report("ready", 1);
    fflush(stdout);
    struct timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    for (char line[256];;) {
        uint8_t bytes[256];
        ssize_t count = read(pty, bytes, sizeof bytes);
        for (ssize_t i = 0; i < count; ++i) receive(bytes[i]);
        struct pollfd in = {.fd = 0, .events = POLLIN};
        if (poll(&in, 1, 0) > 0 && (!fgets(line, sizeof line, stdin) || !obey(line))) break;
        run_until(avr->cycle + MS);
        fflush(stdout);
        next.tv_nsec += 1000000;
        if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, next.tv_sec++;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    }
    leave(0);
}

static void quiet(avr_t *a, const int level, const char *format, va_list args) {
    (void)a;
    if (level <= LOG_ERROR) vfprintf(stderr, format, args);
}

static void set_up(const char *hex_path) {
    uint32_t size, start;
    uint8_t *code = read_ihex_file(hex_path, &size, &start);
    avr = avr_make_mcu_by_name("atmega328p");
    if (!code || !avr) {
        fprintf(stderr, "board: cannot load %s\n", hex_path);
        exit(1);
    }
    avr_init(avr);
    avr->frequency = HZ;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr_loadcode(avr, code, size, start);
    avr->flash[HANGS_AT] = 0xFF, avr->flash[HANGS_AT + 1] = 0xCF;  // rjmp to itself
    avr->codeend = avr->flashend;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            on_sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), on_twi,
                            NULL);
    imu_reset();
}

int main(int argc, char **argv) {
    if (argc != 2 && !(argc == 4 && strcmp(argv[2], "--pty") == 0)) {
        fprintf(stderr, "usage: board firmware.hex [--pty LINK]\n");
        return 2;
    }
    avr_global_logger_set(quiet);
    set_up(argv[1]);
    if (argc == 4) {
        link_path = argv[3];
        is_live = 1;
        run_live();
    }
    run_stepped();
    return 0;
}
