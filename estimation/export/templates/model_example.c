/* Runs the model along inputs from standard input, a sample a line: {{ inputs | join(", ") }}. Prints {{ output }}. */
#include "{{ name }}.h"

#include <stdio.h>
#include <stdlib.h>

static {{ name }}_model model;

int main(void)
{
    char line[1024];
    {{ real }} inputs[{{ NAME }}_INPUTS];
    int begun = 0;
    while (fgets(line, (int)sizeof line, stdin) != NULL) {
        char *rest = line;
        for (int i = 0; i < {{ NAME }}_INPUTS; ++i) {
            inputs[i] = strto{{ "f" if f else "d" }}(rest, &rest);
            rest += (*rest == ',') ? 1 : 0;
        }
        if (begun == 0) {
            {{ name }}_start(&model, inputs);
            begun = 1;
        }
        printf("%.{{ digits }}g\n", (double){{ name }}_step(&model, inputs));
    }
    return EXIT_SUCCESS;
}
