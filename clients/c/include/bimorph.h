/* Bimorph from C: compile a model of an electro-mechanical microsystem, compute its statics and modes, and step it inside a
 * simulator's Newton loop. docs/howto/c.md has an example.
 *
 * Units: all numbers are SI (m, kg, s, A, K, rad), all angular frequencies rad/s.
 *
 * Errors: functions that return int return a bimorph_code. bimorph_error() has the message of the last failed call of the calling
 * thread. A failed call writes to none of its outputs, except where the function says so. No call aborts, and none prints.
 *
 * Memory: a handle belongs to the caller and is released by its _free function, which accepts NULL. Texts that are returned
 * belong to the handle, or to the library, and are never freed by the caller; they end with a zero byte and are UTF-8. Arrays belong
 * to the caller. The one exception is bimorph_device_save, whose bytes are released by bimorph_bytes_free.
 *
 * Threads: a model does not change, and any number of threads may use it at once. A device is used by one thread at a time, and may
 * move between threads; a second concurrent call returns BIMORPH_BUSY and does nothing. A handle is freed when no call uses it. A device
 * keeps what it needs of its model, which may be freed first.
 *
 * Versions: functions and fields are only added within one BIMORPH_ABI. A structure begins with its size as the caller was compiled, so
 * that later fields stay untouched. A program checks bimorph_abi_version() == BIMORPH_ABI once. */
#ifndef BIMORPH_H
#define BIMORPH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BIMORPH_ABI 1

/* Results of calls. */
typedef enum bimorph_code {
    BIMORPH_OK = 0,
    BIMORPH_BAD_ARGUMENT = 1,  /* a null pointer, a wrong length, a number or option out of range */
    BIMORPH_CANNOT_READ = 2,   /* a file cannot be read */
    BIMORPH_BAD_MODEL = 3,     /* the text has errors: the message has file, line and remedy of each */
    BIMORPH_UNKNOWN_NAME = 4,  /* no port, signal or quantity of that name */
    BIMORPH_UNKNOWN_STATE = 5, /* no state of that number in this device */
    BIMORPH_NO_SOLUTION = 6,   /* an analysis has no result within its tolerance */
    BIMORPH_BUSY = 7,          /* another thread uses the device */
    BIMORPH_INTERNAL = 8       /* a fault of the library; the device can still be used */
} bimorph_code;

/* Kinds of trials. */
enum {
    BIMORPH_STATIC = 0,   /* equilibrium, on the branch of the parent */
    BIMORPH_TRANSIENT = 1 /* a step of dt from the parent */
};

/* Results of trials. */
enum {
    BIMORPH_SOLVED = 0,       /* every output holds */
    BIMORPH_SHORTER_STEP = 1, /* the step is too long: repeat with at most `dt_next` */
    BIMORPH_NO_ANSWER = 2     /* none exists; bimorph_error() has the reason */
};

typedef struct bimorph_options bimorph_options;
typedef struct bimorph_model bimorph_model;
typedef struct bimorph_device bimorph_device;

/* A state of a device. States never change. 0: the model at rest as drawn. */
typedef uint64_t bimorph_state;

/* Version of the binary interface in this library. */
uint32_t bimorph_abi_version(void);

/* Version of the library, as in "0.2.0". */
const char *bimorph_version(void);

/* Message of the last failed call of this thread; empty before one. Valid until the next call of this thread that fails. */
const char *bimorph_error(void);

/* --- Options --- */

/* Options with their defaults. */
bimorph_options *bimorph_options_new(void);

/* Sets an option by its name in docs/reference/options.md: "tol", "1e-4". */
int bimorph_options_set(bimorph_options *options, const char *name, const char *value);

/* Sets a parameter of the netlist, as `--set` does: "N", "4" or "w", "2.1u". */
int bimorph_options_set_parameter(bimorph_options *options, const char *name, const char *value);

void bimorph_options_free(bimorph_options *options);

/* --- Models --- */

/* Compiles a file: a netlist, a layout (.cif, .gds) or a JSON document. `options` may be NULL. */
int bimorph_model_open(const char *path, const bimorph_options *options, bimorph_model **model);

/* Compiles a text of `length` bytes: a netlist, or a JSON document. `name` is the file name in messages. */
int bimorph_model_compile(const char *name, const char *text, size_t length, const bimorph_options *options,
                          bimorph_model **model);

/* Warnings about the text, each with its line; empty without any. */
const char *bimorph_model_warnings(const bimorph_model *model);

/* Electrical ports of the netlist, in its order. */
size_t bimorph_model_port_count(const bimorph_model *model);

/* NULL beyond the last. */
const char *bimorph_model_port_name(const bimorph_model *model, size_t index);

/* Names that bimorph_device_read and the signals of a device know. */
size_t bimorph_model_signal_count(const bimorph_model *model);
const char *bimorph_model_signal_name(const bimorph_model *model, size_t index);

/* Mechanical unknowns. */
size_t bimorph_model_unknowns(const bimorph_model *model);

void bimorph_model_free(bimorph_model *model);

/* --- Analyses, on the mesh that the tolerance requires --- */

/* Static equilibrium at one voltage for each port (V); NULL: 0 V at each. `values` receives one number for each of `names`: NODE.x, NODE.y,
 * NODE.rz, BEAM.T, BEAM.Tmax, BEAM.stress, PORT.i, PORT.q, or a sum of these. `jumped`, unless NULL, receives 1 where the part pulled
 * in, snapped through or buckled on the way. */
int bimorph_statics(const bimorph_model *model, const double *volts, const char *const *names, size_t count,
                    double *values, int *jumped);

/* The `count` lowest natural frequencies (Hz) about the equilibrium at these voltages. `errors`, unless NULL, receives the estimated
 * relative error of each, NaN where there is no estimate. */
int bimorph_modes(const bimorph_model *model, const double *volts, size_t count, double *frequencies_hz,
                  double *errors);

/* --- Devices: the model inside a circuit simulator --- */

/* Opens ports and signals by name, in the given order. No ports: every electrical one, in netlist order. A port that is left out is
 * held at 0 V, or free. NODE.x, NODE.vx, BEAM.T and frame.ax are ports too (docs/reference/ngspice.md). */
int bimorph_device_open(const bimorph_model *model, const char *const *ports, size_t port_count,
                        const char *const *signals, size_t signal_count, bimorph_device **device);

size_t bimorph_device_port_count(const bimorph_device *device);
size_t bimorph_device_signal_count(const bimorph_device *device);

/* Unit of the input of a port ("V", "N", "W", ...), of its output ("A", "m", "K", ...), and of a signal; NULL beyond the last. */
const char *bimorph_device_given_unit(const bimorph_device *device, size_t port);
const char *bimorph_device_answered_unit(const bimorph_device *device, size_t port);
const char *bimorph_device_signal_unit(const bimorph_device *device, size_t signal);

/* Set every field of both structures, the rest to zero: bimorph_reply reply = {0};
 *
 * One evaluation request. It is a pure function of its fields: the same request gives the same state and the same bits. */
typedef struct bimorph_trial {
    size_t size;          /* sizeof(bimorph_trial) */
    int32_t mode;         /* BIMORPH_STATIC or BIMORPH_TRANSIENT */
    int32_t reserved;     /* 0 */
    bimorph_state parent; /* state to start from */
    double t;             /* time at the end of the step (s), for messages alone */
    double dt;            /* length of the step (s); ignored by a static trial */
    const double *given;  /* input of each port at t */
} bimorph_trial;

/* The answer. p ports, s signals; matrices are row-major. Arrays that are NULL are not filled. */
typedef struct bimorph_reply {
    size_t size;              /* sizeof(bimorph_reply), set by the caller */
    int32_t status;           /* BIMORPH_SOLVED, BIMORPH_SHORTER_STEP or BIMORPH_NO_ANSWER */
    int32_t jumped;           /* 1: a static trial passed a limit point */
    bimorph_state state;      /* the new state */
    double dt_next;           /* longest next step that is likely to hold (s), or the bound of BIMORPH_SHORTER_STEP */
    double *answered;         /* conduction current of each port (A), or its displacement, velocity, rise (p) */
    double *charges;          /* charge on each port (C) (p) */
    double *answered_given;   /* d answered / d given (p x p) */
    double *charges_given;    /* d charge / d given (F) (p x p) */
    double *signals;          /* value of each signal (s) */
    double *signals_given;    /* d signal / d given (s x p) */
} bimorph_reply;

/* The current of an electrical port is answered + d charges / dt: the caller differentiates the charges over the steps that it accepts. Nothing has to
 * be undone after a rejected step: the caller tries again from the same parent. Where `status` is not BIMORPH_SOLVED the arrays stay as they were. */
int bimorph_device_trial(bimorph_device *device, const bimorph_trial *trial, bimorph_reply *reply);

/* Says that the simulator accepted a state. It frees memory and changes no answer. */
int bimorph_device_accept(bimorph_device *device, bimorph_state state);

/* Warnings of an accepted state, each kind once; empty without any. The text is valid until the next call on this device. */
int bimorph_device_warnings(bimorph_device *device, bimorph_state state, const char **warnings);

/* Small-signal answer about a state at `omega` (rad/s), as pairs of real and imaginary part: admittances (p x p), row: current, column: voltage,
 * and signals per input (s x p). Either may be NULL. */
int bimorph_device_linearize(bimorph_device *device, bimorph_state state, double omega, double *admittance,
                             double *signals);

/* One-sided spectral densities and cross-spectra of ports, then signals, at `omega` about a state: (p+s) x (p+s) pairs of real and imaginary part. */
int bimorph_device_noise(bimorph_device *device, bimorph_state state, double omega, double *spectra);

/* Value of a quantity of a state by name. */
int bimorph_device_read(bimorph_device *device, bimorph_state state, const char *name, double *value);

/* The open ports, signals and `count` states as bytes, from which a device of the same model continues bit by bit. `count` 0: all states. */
int bimorph_device_save(const bimorph_device *device, const bimorph_state *states, size_t count, uint8_t **bytes,
                        size_t *length);

/* Replaces ports, signals and states by those of bimorph_device_save. */
int bimorph_device_load(bimorph_device *device, const uint8_t *bytes, size_t length);

void bimorph_bytes_free(uint8_t *bytes, size_t length);

void bimorph_device_free(bimorph_device *device);

#ifdef __cplusplus
}
#endif

#endif
