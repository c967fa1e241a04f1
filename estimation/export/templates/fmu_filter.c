/* The filter as a model of co-simulation: a step takes one sample, that at its beginning; outputs are what is believed then. */
#include "model.h"

#include <math.h>

static void show(model *m)
{
    double deviations[{{ NAME }}_STATES];
    double *outputs = &m->value[MODEL_OUTPUTS_AT];
    {{ name }}_estimate(&m->inside, outputs, deviations);
    for (int i = 0; i < {{ NAME }}_STATES; ++i) {
        outputs[{{ NAME }}_STATES + i] = deviations[i];
    }
    outputs[2 * {{ NAME }}_STATES] = (double){{ name }}_gate(&m->inside);
}

void model_reset(model *m)
{
    m->begun = 0;
    m->value[0] = 0.0;
    for (int i = 0; i < MODEL_INPUTS; ++i) {
        m->value[MODEL_INPUTS_AT + i] = 0.0;
        m->slope[i] = 0.0;
    }
    for (int i = 0; i < MODEL_INPUTS_AT - MODEL_PARAMETERS_AT; ++i) {
        m->value[MODEL_PARAMETERS_AT + i] = {{ name }}_defaults.row[0][i];
    }
    {{ name }}_start(&m->inside, &{{ name }}_defaults);
    show(m);
}

void model_begin(model *m)
{
    {{ name }}_settings settings = {{ name }}_defaults;
    for (int i = 0; i < MODEL_INPUTS_AT - MODEL_PARAMETERS_AT; ++i) {
        settings.row[0][i] = m->value[MODEL_PARAMETERS_AT + i];
    }
    {{ name }}_start(&m->inside, &settings);
    show(m);
}

int model_step(model *m, double step)
{
    if (!(fabs(step / MODEL_SAMPLE_TIME - 1.0) < 1e-6)) {
        return 0;
    }
    {{ name }}_step(&m->inside, &m->value[MODEL_INPUTS_AT], &m->value[MODEL_INPUTS_AT + {{ NAME }}_DRIVES]);
    m->value[0] += step;
    show(m);
    return 1;
}
