/* Runs an exported filter over a log, and clocks its steps. Compiled with -DNAME=..., -DHEADER=..., -DREAL=...,
 * -DSTATES=..., -DDRIVES=..., -DCHANNELS=... */
#define _POSIX_C_SOURCE 200112L
#include HEADER

#include <time.h>

#define JOINED(a, b) a##_##b
#define OF(a, b) JOINED(a, b)

static OF(NAME, filter) filter;

/* Filter a log; keep every estimate with its deviation. Returns what the gate objects to. */
unsigned int run(long samples, const REAL *drives, const REAL *measured, REAL *values, REAL *deviations, REAL *sums)
{
    OF(NAME, start)(&filter, &OF(NAME, defaults));
    for (long k = 0; k < samples; ++k) {
        OF(NAME, step)(&filter, &drives[k * DRIVES], &measured[k * CHANNELS]);
        OF(NAME, estimate)(&filter, &values[k * STATES], &deviations[k * STATES]);
    }
    for (int c = 0; c < CHANNELS; ++c) {
        sums[c] = OF(NAME, nis)(&filter, c);
    }
    sums[CHANNELS] = OF(NAME, log_likelihood)(&filter);
    return OF(NAME, gate)(&filter);
}

/* Filter a log, nothing kept; return the first estimate's sum, so that no compiler leaves the work out. */
REAL work(long samples, const REAL *drives, const REAL *measured)
{
    REAL values[STATES];
    REAL deviations[STATES];
    OF(NAME, start)(&filter, &OF(NAME, defaults));
    for (long k = 0; k < samples; ++k) {
        OF(NAME, step)(&filter, &drives[k * DRIVES], &measured[k * CHANNELS]);
    }
    OF(NAME, estimate)(&filter, values, deviations);
    return values[STATES - 1];
}

/* Filter a log and note how long each step takes [ns], the clock's own two readings included. */
void clocked(long samples, const REAL *drives, const REAL *measured, long *nanoseconds)
{
    struct timespec begin;
    struct timespec end;
    OF(NAME, start)(&filter, &OF(NAME, defaults));
    for (long k = 0; k < samples; ++k) {
        clock_gettime(CLOCK_MONOTONIC, &begin);
        OF(NAME, step)(&filter, &drives[k * DRIVES], &measured[k * CHANNELS]);
        clock_gettime(CLOCK_MONOTONIC, &end);
        nanoseconds[k] = (end.tv_sec - begin.tv_sec) * 1000000000L + (end.tv_nsec - begin.tv_nsec);
    }
}

/* Wake every period [ns], filter a sample, and note how late each waking was and how long its step took [ns]. */
void paced(long samples, long period, const REAL *drives, const REAL *measured, long *late, long *nanoseconds)
{
    struct timespec due;
    struct timespec begin;
    struct timespec end;
    OF(NAME, start)(&filter, &OF(NAME, defaults));
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (long k = 0; k < samples; ++k) {
        due.tv_nsec += period;
        if (due.tv_nsec >= 1000000000L) {
            due.tv_nsec -= 1000000000L;
            due.tv_sec += 1;
        }
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        clock_gettime(CLOCK_MONOTONIC, &begin);
        OF(NAME, step)(&filter, &drives[k * DRIVES], &measured[k * CHANNELS]);
        clock_gettime(CLOCK_MONOTONIC, &end);
        late[k] = (begin.tv_sec - due.tv_sec) * 1000000000L + (begin.tv_nsec - due.tv_nsec);
        nanoseconds[k] = (end.tv_sec - begin.tv_sec) * 1000000000L + (end.tv_nsec - begin.tv_nsec);
    }
}
