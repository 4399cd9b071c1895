/*
 * One ATmega328P in libsimavr, stepped by cycles and seen through a flat C interface.
 *
 * Knows registers, pins, bytes and millivolts; no protocol and no physics: the plant is the
 * project's, in Python, and is stepped between two calls of host_run().
 *
 * What the bridge does is read from DDR, PORT, COM and OCR registers, not from pin interrupts: those
 * of simavr 1.6 can stay high after a reset (its issue 518), and two PWM modes show no pin at all.
 */
#include <math.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_elf.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {  /* data addresses of the ATmega328P */
    DDRB = 0x24, PORTB = 0x25, MCUSR = 0x54,
    TCCR1A = 0x80, TCCR1B = 0x81, ICR1 = 0x86, OCR1A = 0x88, OCR1B = 0x8A,
    UCSR0A = 0xC0, UBRR0 = 0xC4,
};
enum { PIN_ENABLE = 0, PIN_HEAT = 1, PIN_COOL = 2 };  /* of port B, firmware/PROTOCOL.md */
enum { ADC_CHANNELS = 8, IN_BYTES = 1 << 14, OUT_BYTES = 1 << 16 };
enum { HZ = 16000000, SUPPLY_MV = 5000 };
enum { SAMPLE_CYCLES = 1600 };   /* the bridge is looked at every 0.1 ms */
enum { BURST_CYCLES = 400 };     /* less than the time of a byte on the line, 640 */
enum { SELF_JUMP_AT = 0x7E00 };  /* flash that no firmware of ours reaches */

/* What the bridge did since it was last asked; cycles of 16 MHz. */
typedef struct {
    double heat, cool;          /* mean duty, 0..1, while enabled */
    uint64_t samples, shoot_through, last_driven;
    uint32_t resets;
    int32_t is_driven;
} bridge_t;

typedef struct {
    avr_t *avr;
    avr_irq_t *uart_in, *adc;
    uint8_t in[IN_BYTES], out[OUT_BYTES];
    uint32_t in_head, in_tail, out_head, out_tail, out_lost;
    uint64_t next_byte, next_sample;
    double millivolts[ADC_CHANNELS], noise_mv, hum_mv, hum_hz;
    uint32_t random;
    int hides_cause;
    bridge_t bridge;
} host_t;

static void say_nothing(avr_t *avr, const int level, const char *text, va_list arguments) {
    (void)avr; (void)level; (void)text; (void)arguments;
}

static void never_sleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr; (void)cycles; }

static double noise(host_t *host) {  /* about normal, standard deviation 1 */
    double sum = 0.0;
    for (int i = 0; i < 12; i++) {
        host->random ^= host->random << 13;
        host->random ^= host->random >> 17;
        host->random ^= host->random << 5;
        sum += host->random / 4294967296.0;
    }
    return sum - 6.0;
}

static void on_byte_out(struct avr_irq_t *irq, uint32_t value, void *param) {
    host_t *host = param;
    (void)irq;
    if (host->out_head - host->out_tail < OUT_BYTES)
        host->out[host->out_head++ % OUT_BYTES] = (uint8_t)value;
    else
        host->out_lost++;
}

/* A conversion begins: the pin of its channel takes the sensor's voltage, with fresh noise. */
static void on_conversion(struct avr_irq_t *irq, uint32_t value, void *param) {
    host_t *host = param;
    union { avr_adc_mux_t mux; uint32_t value; } what = { .value = value };
    (void)irq;
    if (what.mux.kind != ADC_MUX_SINGLE || what.mux.src >= ADC_CHANNELS) return;
    double mv = host->millivolts[what.mux.src] + host->noise_mv * noise(host);
    mv += host->hum_mv * sin(6.283185307179586 * host->hum_hz * (double)host->avr->cycle / HZ);
    mv = mv < 0.0 ? 0.0 : mv > SUPPLY_MV ? SUPPLY_MV : mv;
    avr_raise_irq(host->adc + what.mux.src, (uint32_t)(mv + 0.5));
}

static unsigned word(const uint8_t *data, int at) { return data[at] | data[at + 1] << 8; }

static unsigned pwm_top(const uint8_t *data) {
    switch ((data[TCCR1A] & 3) | ((data[TCCR1B] >> 1) & 12)) {
    case 1: case 5: return 255;
    case 2: case 6: return 511;
    case 3: case 7: return 1023;
    case 8: case 10: case 14: return word(data, ICR1);
    default: return 0;
    }
}

/* Share of the time that a compare pin of timer 1 is high, 0..1. */
static double pin_share(const uint8_t *data, int pin, int compare, int com_shift) {
    int com = (data[TCCR1A] >> com_shift) & 3;
    unsigned top = pwm_top(data);
    if (!(data[DDRB] >> pin & 1)) return 0.0;  /* floating: the pull-down holds it low */
    if (com == 0 || top == 0 || (data[TCCR1B] & 7) == 0) return data[PORTB] >> pin & 1;
    double share = (word(data, compare) + 1.0) / (top + 1.0);
    share = share > 1.0 ? 1.0 : share;
    return com == 2 ? share : com == 3 ? 1.0 - share : 0.0;
}

static void sample(host_t *host) {
    const uint8_t *data = host->avr->data;
    bridge_t *bridge = &host->bridge;
    int enabled = (data[DDRB] >> PIN_ENABLE & 1) && (data[PORTB] >> PIN_ENABLE & 1);
    double heat = enabled ? pin_share(data, PIN_HEAT, OCR1A, 6) : 0.0;
    double cool = enabled ? pin_share(data, PIN_COOL, OCR1B, 4) : 0.0;
    bridge->heat += heat;
    bridge->cool += cool;
    bridge->samples++;
    bridge->shoot_through += heat > 0.0 && cool > 0.0;
    bridge->is_driven = heat > 0.0 || cool > 0.0;
    if (bridge->is_driven) bridge->last_driven = host->avr->cycle;
}

static uint64_t byte_cycles(const uint8_t *data) {
    return (uint64_t)(word(data, UBRR0) + 1) * (data[UCSR0A] & 2 ? 8 : 16) * 10;
}

static void feed(host_t *host) {
    uint64_t now = host->avr->cycle;
    if (host->in_head == host->in_tail || now < host->next_byte) return;
    avr_raise_irq(host->uart_in, host->in[host->in_tail++ % IN_BYTES]);
    uint64_t spacing = byte_cycles(host->avr->data);
    host->next_byte = (host->next_byte + spacing > now ? host->next_byte : now) + spacing;
}

static void after_reset(host_t *host) {
    host->bridge.resets++;
    host->avr->run_cycle_limit = BURST_CYCLES;
    if (host->hides_cause) host->avr->data[MCUSR] = 0;
}

static void connect(host_t *host) {
    avr_t *avr = host->avr;
    uint32_t no_echo = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &no_echo);
    avr_irq_t *out = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT);
    avr_irq_register_notify(out, on_byte_out, host);
    host->uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    host->adc = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
    avr_irq_register_notify(host->adc + ADC_IRQ_OUT_TRIGGER, on_conversion, host);
}

static int load(host_t *host, const char *elf) {
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);  /* optional fields are read too */
    if (elf_read_firmware(elf, &firmware)) return 0;
    if (firmware.flashsize > SELF_JUMP_AT) return 0;
    firmware.frequency = HZ;
    firmware.vcc = firmware.avcc = firmware.aref = SUPPLY_MV;
    avr_load_firmware(host->avr, &firmware);
    free(firmware.flash);
    host->avr->frequency = HZ;
    host->avr->flash[SELF_JUMP_AT] = 0xFF;  /* rjmp . */
    host->avr->flash[SELF_JUMP_AT + 1] = 0xCF;
    host->avr->codeend = host->avr->flashend;
    return 1;
}

void host_free(host_t *host) {
    avr_terminate(host->avr);
    free(host->avr);
    free(host);
}

/* A board switched on with this program, or NULL. */
host_t *host_new(const char *elf, uint32_t seed, double noise_mv) {
    host_t *host = calloc(1, sizeof *host);
    avr_global_logger_set(say_nothing);
    host->avr = avr_make_mcu_by_name("atmega328p");
    avr_init(host->avr);
    host->avr->log = LOG_NONE;
    if (!load(host, elf)) {
        host_free(host);
        return NULL;
    }
    host->avr->sleep = never_sleep;
    host->avr->run_cycle_limit = BURST_CYCLES;
    host->random = seed * 2654435761u | 1u;
    host->noise_mv = noise_mv;
    host->avr->data[MCUSR] = 1;  /* power-on */
    connect(host);
    return host;
}

/* Run for at least so many cycles; the state of the core, 6 or 7 when it has stopped for good. */
int host_run(host_t *host, uint64_t cycles) {
    avr_t *avr = host->avr;
    uint64_t end = avr->cycle + cycles;
    int state = avr->state;
    while (avr->cycle < end && state != cpu_Done && state != cpu_Crashed) {
        if (avr->cycle >= host->next_sample) {
            sample(host);
            host->next_sample = avr->cycle - avr->cycle % SAMPLE_CYCLES + SAMPLE_CYCLES;
        }
        feed(host);
        avr_run_t running = avr->run;
        state = avr_run(avr);
        if (running != avr_callback_run_raw) after_reset(host);
    }
    return state;
}

/* Means since the last restart; counts and times since switching on. */
void host_bridge(host_t *host, bridge_t *bridge, int restart) {
    bridge_t *sum = &host->bridge;
    *bridge = *sum;
    if (sum->samples) {
        bridge->heat /= (double)sum->samples;
        bridge->cool /= (double)sum->samples;
    }
    if (!restart) return;
    sum->heat = sum->cool = 0.0;
    sum->samples = 0;
}

/* Whether the bridge is driven at this moment. */
int host_is_driven(host_t *host) {
    bridge_t kept = host->bridge;
    sample(host);
    int driven = host->bridge.is_driven;
    host->bridge = kept;
    return driven;
}

void host_voltage(host_t *host, int channel, double millivolts) {
    host->millivolts[channel % ADC_CHANNELS] = millivolts;
}

/* Mains hum, alike on all pins: amplitude and frequency. */
void host_hum(host_t *host, double millivolts, double hz) {
    host->hum_mv = millivolts;
    host->hum_hz = hz;
}

/* The cut-out's break contact at PD7: low while it is closed, so while the cut-out is open. */
void host_cut_out(host_t *host, int is_grounded) {
    avr_irq_t *pin = avr_io_getirq(host->avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 7);
    pin->flags |= IRQ_FLAG_INIT; /* or the level of before a reset, which clears PIND, is not sent again */
    avr_raise_irq(pin, is_grounded == 0);
}

int host_read(host_t *host, uint8_t *bytes, int most) {
    int count = 0;
    while (count < most && host->out_tail != host->out_head)
        bytes[count++] = host->out[host->out_tail++ % OUT_BYTES];
    return count;
}

int host_write(host_t *host, const uint8_t *bytes, int count) {
    int written = 0;
    if (host->in_head == host->in_tail && host->next_byte < host->avr->cycle)
        host->next_byte = host->avr->cycle;
    while (written < count && host->in_head - host->in_tail < IN_BYTES)
        host->in[host->in_head++ % IN_BYTES] = bytes[written++];
    return written;
}

uint64_t host_cycle(host_t *host) { return host->avr->cycle; }
uint32_t host_bytes_lost(host_t *host) { return host->out_lost; }
int host_peek(host_t *host, int address) { return host->avr->data[address]; }
void host_poke(host_t *host, int address, int value) { host->avr->data[address] = (uint8_t)value; }

/* From outside: brown-out, reset button; bytes on their way are lost. */
void host_reset(host_t *host, int cause_bits) {
    avr_reset(host->avr);
    host->avr->data[MCUSR] = (uint8_t)cause_bits;
    host->in_tail = host->in_head;
    host->next_byte = host->avr->cycle;
    after_reset(host);
}

/* From now on a boot loader such as optiboot has wiped MCUSR before the program begins. */
void host_hide_reset_cause(host_t *host) { host->hides_cause = 1; }

/* The program is caught in one instruction for ever. It may have been in an interrupt, with others
 * off: both cases are set. */
void host_hang(host_t *host, int interrupts_off) {
    avr_t *avr = host->avr;
    avr->pc = SELF_JUMP_AT;
    avr->state = cpu_Running;
    avr->sreg[S_I] = !interrupts_off;
    avr->interrupt_state = interrupts_off ? 0 : -2; /* looks for waiting ones, as after sei */
}

/* Writes bytes into the EEPROM, as an earlier run of the program left them. */
void host_eeprom(host_t *host, int address, uint8_t *bytes, int count) {
    avr_eeprom_desc_t wanted = {.ee = bytes, .offset = (uint16_t)address, .size = (uint32_t)count};
    avr_ioctl(host->avr, AVR_IOCTL_EEPROM_SET, &wanted);
}

/* Registers, I/O and RAM; the size in bytes. */
int host_memory(host_t *host, uint8_t *bytes, int most) {
    int size = host->avr->ramend + 1;
    memcpy(bytes, host->avr->data, (size_t)(size < most ? size : most));
    return size;
}
