/* What the interface asks of the model inside. Values stand by their references: 0 is time. */
#ifndef MODEL_H
#define MODEL_H

#include "{{ name }}.h"

#define MODEL_TOKEN "{{ token }}"
#define MODEL_VALUES {{ values }}
#define MODEL_PARAMETERS_AT 1
#define MODEL_INPUTS_AT {{ inputs_at }}
#define MODEL_OUTPUTS_AT {{ outputs_at }}
#define MODEL_INPUTS (MODEL_OUTPUTS_AT - MODEL_INPUTS_AT)
#define MODEL_SAMPLE_TIME {{ sample_time }} /* s */

typedef struct {
    double value[MODEL_VALUES];
    double slope[MODEL_INPUTS]; /* of the inputs, a second */
    int begun;
    {{ name }}_{{ kind }} inside;
} model;

/* Set every value to its start. */
void model_reset(model *m);

/* End the initialisation: what is inside begins with the parameters. */
void model_begin(model *m);

/* Go on by a communication step [s]; 0 if that is no whole number of samples, or none that the model takes. */
int model_step(model *m, double step);

#endif
