/* The contract of bimorph.h, checked from C. Prints one line for each part and ends with status 0 where all of it holds.
 *
 * The plate of PLATE is a mass m on a spring k over an electrode: k u = e A V^2 / (2 (g - u)^2) at rest, and its frequency without voltage is
 * sqrt(k/m) / (2 pi). Both are closed forms, so that every number here has its reference in this file. */
#include "bimorph.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char PLATE[] = "param k=1\n"
                            "anchor  * [f] [l=1u w=1u h=1u]\n"
                            "mass2d  * [m] [m=1e-10 b=1e-7]\n"
                            "guide2d * [m] []\n"
                            "spring2d * [f m] [kx=k]\n"
                            "anchor  * [e] [l=1u w=1u h=1u]\n"
                            "gap plategap2d * [m e] [A=1e-8 gap=2u permittivity=8.854e-12 fringe=none]\n"
                            "eground * [e] []\n"
                            "drive port * [m e] []\n";

static int failures = 0;

static void check(int good, const char *what, int line) {
    if (!good) {
        fprintf(stderr, "contract.c:%d: %s; last message: %s\n", line, what, bimorph_error());
        failures++;
    }
}

#define CHECK(good) check((good), #good, __LINE__)
#define NEAR(a, b, relative) check(fabs((a) - (b)) <= (relative) * fabs(b), #a " is near " #b, __LINE__)

static bimorph_model *plate(void) {
    bimorph_model *model = NULL;
    CHECK(bimorph_model_compile("plate.net", PLATE, strlen(PLATE), NULL, &model) == BIMORPH_OK);
    return model;
}

static bimorph_device *opened(const bimorph_model *model) {
    static const char *const signals[] = {"m.x", "gap.C"};
    bimorph_device *device = NULL;
    CHECK(bimorph_device_open(model, NULL, 0, signals, 2, &device) == BIMORPH_OK);
    return device;
}

/* Every argument that cannot be used is a code with a message, and no crash. */
static void arguments(void) {
    bimorph_model *model = NULL;
    double value = 0.0;
    CHECK(bimorph_abi_version() == BIMORPH_ABI);
    CHECK(strlen(bimorph_version()) >= 5);
    CHECK(bimorph_model_open(NULL, NULL, &model) == BIMORPH_BAD_ARGUMENT);
    CHECK(strstr(bimorph_error(), "`path` is a null pointer") != NULL);
    CHECK(bimorph_model_open("/no/such/file.net", NULL, &model) == BIMORPH_CANNOT_READ);
    CHECK(strstr(bimorph_error(), "/no/such/file.net") != NULL);
    CHECK(bimorph_model_compile("a.net", NULL, 5, NULL, &model) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_model_compile("a.net", "beam2d x [a b] [l=1]\n", 21, NULL, &model) == BIMORPH_BAD_MODEL);
    CHECK(strstr(bimorph_error(), "E031") != NULL && strstr(bimorph_error(), "a.net") != NULL);
    CHECK(bimorph_model_compile("\xff", PLATE, strlen(PLATE), NULL, &model) == BIMORPH_BAD_ARGUMENT);
    CHECK(model == NULL);
    CHECK(bimorph_model_port_count(NULL) == 0 && bimorph_model_port_name(NULL, 0) == NULL);
    CHECK(bimorph_statics(NULL, NULL, NULL, 0, NULL, NULL) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_modes(NULL, NULL, 1, &value, NULL) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_device_accept(NULL, 1) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_options_set(NULL, "tol", "1") == BIMORPH_BAD_ARGUMENT);
    bimorph_model_free(NULL);
    bimorph_device_free(NULL);
    bimorph_options_free(NULL);
    bimorph_bytes_free(NULL, 0);

    bimorph_options *options = bimorph_options_new();
    CHECK(bimorph_options_set(options, "tolerance", "1e-4") == BIMORPH_BAD_ARGUMENT);
    CHECK(strstr(bimorph_error(), "tol") != NULL);
    CHECK(bimorph_options_set(options, "tol", "2") == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_options_set(options, "tol", "small") == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_options_set(options, "tol", "1m") == BIMORPH_OK);
    CHECK(bimorph_options_set(options, "linear", "false") == BIMORPH_OK);
    CHECK(bimorph_options_set_parameter(options, "q", "1") == BIMORPH_OK);
    CHECK(bimorph_model_compile("plate.net", PLATE, strlen(PLATE), options, &model) == BIMORPH_BAD_MODEL);
    CHECK(strstr(bimorph_error(), "E048") != NULL);
    bimorph_options_free(options);
    puts("arguments");
}

/* Statics and modes agree with the closed forms, on a parameter that was set. */
static void analyses(void) {
    const double k = 2.0, e = 8.854e-12, area = 1e-8, gap = 2e-6, pi = 3.14159265358979323846;
    const char *const names[] = {"m.x", "drive.q", "m.x - m.x"};
    const double volts[] = {3.0};
    double values[3], hertz[1], error[1];
    int jumped = -1;
    bimorph_model *model = NULL;
    bimorph_options *options = bimorph_options_new();
    CHECK(bimorph_options_set_parameter(options, "k", "2") == BIMORPH_OK);
    CHECK(bimorph_model_compile("plate.net", PLATE, strlen(PLATE), options, &model) == BIMORPH_OK);
    bimorph_options_free(options);
    CHECK(bimorph_model_port_count(model) == 1);
    CHECK(strcmp(bimorph_model_port_name(model, 0), "drive") == 0 && bimorph_model_port_name(model, 1) == NULL);
    CHECK(strlen(bimorph_model_warnings(model)) == 0);
    CHECK(bimorph_model_unknowns(model) > 0);
    size_t found = 0;
    for (size_t i = 0; i < bimorph_model_signal_count(model); i++) {
        found += strcmp(bimorph_model_signal_name(model, i), "m.x") == 0;
    }
    CHECK(found == 1);
    CHECK(bimorph_statics(model, volts, names, 3, values, &jumped) == BIMORPH_OK);
    double u = values[0], left = gap - u;
    NEAR(k * u, e * area * volts[0] * volts[0] / (2.0 * left * left), 1e-7);
    NEAR(values[1], e * area * volts[0] / left, 1e-7);
    CHECK(values[2] == 0.0 && jumped == 0);
    CHECK(bimorph_statics(model, volts, names, 1, NULL, NULL) == BIMORPH_BAD_ARGUMENT);
    const char *const wrong[] = {"n.x"};
    values[0] = 7.0;
    CHECK(bimorph_statics(model, volts, wrong, 1, values, NULL) == BIMORPH_UNKNOWN_NAME);
    CHECK(values[0] == 7.0);
    const double infinite[] = {HUGE_VAL};
    CHECK(bimorph_statics(model, infinite, names, 1, values, NULL) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_modes(model, NULL, 1, hertz, error) == BIMORPH_OK);
    NEAR(hertz[0], sqrt(k / 1e-10) / (2.0 * pi), 1e-9);
    CHECK(bimorph_modes(model, NULL, 0, hertz, error) == BIMORPH_BAD_ARGUMENT);
    bimorph_model_free(model);
    puts("analyses");
}

static bimorph_reply tried(bimorph_device *device, int mode, bimorph_state parent, double dt, double volts,
                           double *charge, double *slope, double *signals) {
    bimorph_trial trial = {0};
    bimorph_reply reply = {0};
    trial.size = sizeof trial;
    trial.mode = mode;
    trial.parent = parent;
    trial.t = dt;
    trial.dt = dt;
    trial.given = &volts;
    reply.size = sizeof reply;
    reply.charges = charge;
    reply.charges_given = slope;
    reply.signals = signals;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_OK);
    CHECK(reply.status == BIMORPH_SOLVED && reply.state != 0);
    return reply;
}

/* Trials are pure, charges have their exact derivatives, rejected steps leave no trace, and states continue bit by bit from bytes. */
static void device(void) {
    bimorph_model *model = plate();
    bimorph_device *device = opened(model), *other = opened(model);
    bimorph_model_free(model);
    CHECK(bimorph_device_port_count(device) == 1 && bimorph_device_signal_count(device) == 2);
    CHECK(strcmp(bimorph_device_given_unit(device, 0), "V") == 0);
    CHECK(strcmp(bimorph_device_answered_unit(device, 0), "A") == 0);
    CHECK(strcmp(bimorph_device_signal_unit(device, 0), "m") == 0 && bimorph_device_signal_unit(device, 2) == NULL);
    double charge, slope, signals[2], again, slope_again;
    bimorph_reply rest = tried(device, BIMORPH_STATIC, 0, 0.0, 1.0, &charge, &slope, signals);
    bimorph_reply same = tried(device, BIMORPH_STATIC, 0, 0.0, 1.0, &again, &slope_again, NULL);
    CHECK(same.state == rest.state && again == charge && slope_again == slope);
    NEAR(charge, signals[1] * 1.0, 1e-12);
    CHECK(bimorph_device_accept(device, rest.state) == BIMORPH_OK);
    const char *warnings = NULL;
    CHECK(bimorph_device_warnings(device, rest.state, &warnings) == BIMORPH_OK && warnings != NULL);

    /* one step of 1 us to 2 V, with a rejected one between */
    const double h = 1e-3, dt = 1e-6;
    double high, low, unused;
    bimorph_reply step = tried(device, BIMORPH_TRANSIENT, rest.state, dt, 2.0, &charge, &slope, signals);
    tried(device, BIMORPH_TRANSIENT, rest.state, dt, 2.0 + h, &high, NULL, NULL);
    tried(device, BIMORPH_TRANSIENT, rest.state, dt, 2.0 - h, &low, NULL, NULL);
    NEAR(slope, (high - low) / (2.0 * h), 1e-6);
    bimorph_reply repeated = tried(device, BIMORPH_TRANSIENT, rest.state, dt, 2.0, &again, &slope_again, NULL);
    CHECK(repeated.state == step.state && again == charge && slope_again == slope);
    CHECK(step.dt_next > 0.0);

    /* at low frequency the admittance is j omega dq/dV of the equilibrium */
    double admittance[2], gains[4];
    CHECK(bimorph_device_linearize(device, rest.state, 1.0, admittance, gains) == BIMORPH_OK);
    tried(device, BIMORPH_STATIC, rest.state, 0.0, 1.0, &unused, &slope, NULL);
    NEAR(admittance[1], slope, 1e-9);
    double spectra[2 * 9], x = 0.0;
    CHECK(bimorph_device_noise(device, rest.state, 6.0e4, spectra) == BIMORPH_OK && spectra[8] > 0.0);
    CHECK(bimorph_device_read(device, step.state, "m.x", &x) == BIMORPH_OK && x == signals[0]);
    CHECK(bimorph_device_read(device, step.state, "nothing", &x) == BIMORPH_UNKNOWN_NAME);

    /* another device continues from bytes with the same bits */
    uint8_t *bytes = NULL;
    size_t length = 0;
    CHECK(bimorph_device_save(device, &step.state, 1, &bytes, &length) == BIMORPH_OK && length > 0);
    CHECK(bimorph_device_load(other, bytes, length) == BIMORPH_OK);
    bimorph_reply here = tried(device, BIMORPH_TRANSIENT, step.state, dt, 2.5, &charge, &slope, NULL);
    bimorph_reply there = tried(other, BIMORPH_TRANSIENT, step.state, dt, 2.5, &again, &slope_again, NULL);
    CHECK(here.state == there.state && charge == again && slope == slope_again);
    CHECK(bimorph_device_load(other, bytes, length - 1) == BIMORPH_BAD_ARGUMENT);
    bimorph_bytes_free(bytes, length);

    /* faults of requests */
    bimorph_trial trial = {0};
    bimorph_reply reply = {0};
    double volts = 1.0;
    trial.given = &volts;
    reply.size = sizeof reply;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_BAD_ARGUMENT);
    CHECK(strstr(bimorph_error(), "trial") != NULL && strstr(bimorph_error(), "size") != NULL);
    trial.size = sizeof trial;
    trial.parent = 12345;
    trial.mode = BIMORPH_TRANSIENT;
    trial.dt = dt;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_UNKNOWN_STATE);
    trial.parent = 0;
    trial.dt = -1.0;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_BAD_ARGUMENT);
    trial.mode = 7;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_BAD_ARGUMENT);
    trial.mode = BIMORPH_STATIC;
    trial.given = NULL;
    CHECK(bimorph_device_trial(device, &trial, &reply) == BIMORPH_BAD_ARGUMENT);
    CHECK(bimorph_device_linearize(device, 0, 1.0, admittance, gains) == BIMORPH_UNKNOWN_STATE);
    CHECK(bimorph_device_linearize(device, rest.state, -1.0, admittance, gains) == BIMORPH_BAD_ARGUMENT);
    bimorph_device_free(device);
    bimorph_device_free(other);
    puts("device");
}

typedef struct {
    const bimorph_model *model;
    double charge;
} job;

static void *run(void *argument) {
    job *mine = argument;
    bimorph_device *device = opened(mine->model);
    bimorph_state state = tried(device, BIMORPH_STATIC, 0, 0.0, 1.0, &mine->charge, NULL, NULL).state;
    for (int step = 0; step < 200; step++) {
        double volts = 1.0 + sin(0.1 * step);
        state = tried(device, BIMORPH_TRANSIENT, state, 1e-6, volts, &mine->charge, NULL, NULL).state;
        CHECK(bimorph_device_accept(device, state) == BIMORPH_OK);
    }
    bimorph_device_free(device);
    return NULL;
}

/* Threads share a model, each with a device of its own: the same bits. */
static void threads(void) {
    pthread_t others[4];
    job jobs[4];
    bimorph_model *model = plate();
    for (int i = 0; i < 4; i++) {
        jobs[i].model = model;
        CHECK(pthread_create(&others[i], NULL, run, &jobs[i]) == 0);
    }
    for (int i = 0; i < 4; i++) {
        CHECK(pthread_join(others[i], NULL) == 0);
        CHECK(jobs[i].charge == jobs[0].charge);
    }
    bimorph_model_free(model);
    puts("threads");
}

/* A netlist or document of the command line: the charge of its first port at 1 V, printed in full. */
static void file(const char *path) {
    bimorph_model *model = NULL;
    CHECK(bimorph_model_open(path, NULL, &model) == BIMORPH_OK);
    if (model == NULL) return;
    const char *port = bimorph_model_port_name(model, 0);
    char name[256];
    snprintf(name, sizeof name, "%s.q", port ? port : "none");
    const char *const names[] = {name};
    double *volts = calloc(bimorph_model_port_count(model) + 1, sizeof *volts), charge = 0.0;
    volts[0] = 1.0;
    CHECK(bimorph_statics(model, volts, names, 1, &charge, NULL) == BIMORPH_OK);
    printf("%s %.17g\n", name, charge);
    free(volts);
    bimorph_model_free(model);
}

int main(int count, char **words) {
    arguments();
    analyses();
    device();
    threads();
    for (int i = 1; i < count; i++) file(words[i]);
    return failures ? 1 : 0;
}
