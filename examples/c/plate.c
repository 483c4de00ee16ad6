/* An electrostatic plate behind a resistor, in a circuit simulator of thirty lines: backward Euler on the charge, Newton with the device's own derivative,
 * half the step where the device or Newton needs it. docs/howto/c.md explains the calls. */
#include "bimorph.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char NETLIST[] = "anchor   * [f] [l=1u w=1u h=1u]\n"
                              "mass2d   * [m] [m=1e-10 b=2e-6]\n"
                              "guide2d  * [m] []\n"
                              "spring2d * [f m] [kx=1]\n"
                              "anchor   * [e] [l=1u w=1u h=1u]\n"
                              "gap plategap2d * [m e] [A=1e-8 gap=2u]\n"
                              "eground * [e] []\n"
                              "drive port * [m e] []\n";

/* Ends the program with the library's message where a call fails. */
static void need(int code) {
    if (code != BIMORPH_OK) {
        fprintf(stderr, "%s\n", bimorph_error());
        exit(1);
    }
}

int main(void) {
    const double source = 6.0, ohms = 1e9, stop = 200e-6;
    const char *const signals[] = {"m.x"};
    bimorph_model *model;
    bimorph_device *device;
    need(bimorph_model_compile("plate.net", NETLIST, strlen(NETLIST), NULL, &model));
    need(bimorph_device_open(model, NULL, 0, signals, 1, &device));
    bimorph_model_free(model);

    double volts = 0.0, charge, slope, x, accepted_charge, t = 0.0, dt = 1e-6, next_print = 50e-6;
    bimorph_trial trial = {sizeof trial, BIMORPH_STATIC, 0, 0, 0.0, 0.0, &volts};
    bimorph_reply reply = {.size = sizeof reply, .charges = &charge, .charges_given = &slope, .signals = &x};
    need(bimorph_device_trial(device, &trial, &reply));
    need(bimorph_device_accept(device, reply.state));
    trial.parent = reply.state;
    trial.mode = BIMORPH_TRANSIENT;
    accepted_charge = charge;
    double accepted_volts = volts;

    printf("   t/us      v/V     x/nm\n");
    while (t < stop - 1e-12) {
        /* (source - v)/R = (q(v) - q0)/dt */
        int solved = 0;
        trial.t = t + dt;
        trial.dt = dt;
        for (int iteration = 0; iteration < 20 && !solved; iteration++) {
            need(bimorph_device_trial(device, &trial, &reply));
            if (reply.status != BIMORPH_SOLVED) break;
            double current = (source - volts) / ohms - (charge - accepted_charge) / dt;
            double change = current / (1.0 / ohms + slope / dt);
            solved = fabs(change) < 1e-9;
            volts += change;
        }
        if (!solved) {
            /* a rejected step leaves nothing to undo */
            volts = accepted_volts;
            dt *= 0.5;
            continue;
        }
        need(bimorph_device_accept(device, reply.state));
        trial.parent = reply.state;
        accepted_charge = charge;
        accepted_volts = volts;
        t += dt;
        if (t > next_print - 1e-12) {
            printf("%7.1f %8.3f %8.2f\n", t * 1e6, volts, x * 1e9);
            next_print += 50e-6;
        }
    }
    bimorph_device_free(device);
    return 0;
}
