/* Filters rows of CSV from standard input: {{ drive_names | join(", ") }}, {{ channel_names | join(", ") }}, in SI.
 * A line with names of columns is skipped; an empty field is a missing sample. Prints, row by row, every
 * estimate and its standard deviation, in SI; in the end, what the gate objects to, on standard error. */
#include "{{ name }}.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static {{ name }}_filter filter;

/* Count the fields of a line. */
static int fields(const char *line)
{
    int count = 1;
    for (int i = 0; line[i] != '\0'; ++i) {
        count += (line[i] == ',') ? 1 : 0;
    }
    return count;
}

/* Read the next field of a line, and move on behind it. */
static {{ real }} field(char **place)
{
    char *end = *place;
    const {{ real }} value = strto{{ "f" if f else "d" }}(*place, &end);
    const int empty = (end == *place);
    end += strcspn(end, ",");
    *place = (*end == ',') ? end + 1 : end;
    return empty ? ({{ real }})NAN : value;
}

int main(void)
{
    char line[4096];
    {{ real }} drives[{{ NAME }}_DRIVES];
    {{ real }} sample[{{ NAME }}_CHANNELS];
    {{ real }} values[{{ NAME }}_STATES];
    {{ real }} deviations[{{ NAME }}_STATES];
    {{ name }}_start(&filter, &{{ name }}_defaults);
    while (fgets(line, (int)sizeof line, stdin) != NULL) {
        char *place = line;
        if (strpbrk(line, "_") != NULL) { /* names of columns */
            continue;
        }
        if (fields(line) != {{ NAME }}_DRIVES + {{ NAME }}_CHANNELS) {
            fprintf(stderr, "a row needs %d fields with commas between them, got: %s\n",
                    {{ NAME }}_DRIVES + {{ NAME }}_CHANNELS, line);
            return EXIT_FAILURE;
        }
        for (int i = 0; i < {{ NAME }}_DRIVES; ++i) {
            drives[i] = field(&place);
        }
        for (int c = 0; c < {{ NAME }}_CHANNELS; ++c) {
            sample[c] = field(&place);
        }
        {{ name }}_step(&filter, drives, sample);
        {{ name }}_estimate(&filter, values, deviations);
        for (int i = 0; i < {{ NAME }}_STATES; ++i) {
            printf("%.{{ digits }}g,%.{{ digits }}g%c", (double)values[i], (double)deviations[i],
                   (i + 1 < {{ NAME }}_STATES) ? ',' : '\n');
        }
    }
    for (int c = 0; c < {{ NAME }}_CHANNELS; ++c) {
        fprintf(stderr, "mean squared innovation %d: %g of 1\n", c, (double){{ name }}_nis(&filter, c));
    }
    fprintf(stderr, "gate: %u\nlog likelihood: %.{{ digits }}g\n", {{ name }}_gate(&filter),
            (double){{ name }}_log_likelihood(&filter));
    return EXIT_SUCCESS;
}
