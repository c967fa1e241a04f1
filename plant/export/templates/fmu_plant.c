/* The plant as a model of co-simulation: inputs are held over a step, or linear where their slope is given. */
#include "model.h"

#include <math.h>

static void show(model *m)
{
    {{ name }}_outputs(&m->inside, &m->value[MODEL_OUTPUTS_AT]);
}

void model_reset(model *m)
{
    m->begun = 0;
    m->value[0] = 0.0;
    m->slope[0] = 0.0;
    for (int i = 0; i < {{ NAME }}_ROWS; ++i) {
        m->value[MODEL_PARAMETERS_AT + i] = {{ name }}_defaults.row[i];
    }
    for (int i = 0; i < {{ NAME }}_STATES; ++i) {
        m->value[MODEL_PARAMETERS_AT + {{ NAME }}_ROWS + i] = {{ name }}_defaults.state[i];
    }
    m->value[MODEL_INPUTS_AT] = 0.0;
    {{ name }}_start(&m->inside, &{{ name }}_defaults, 0.0);
    show(m);
}

void model_begin(model *m)
{
    {{ name }}_settings settings;
    for (int i = 0; i < {{ NAME }}_ROWS; ++i) {
        settings.row[i] = m->value[MODEL_PARAMETERS_AT + i];
    }
    for (int i = 0; i < {{ NAME }}_STATES; ++i) {
        settings.state[i] = m->value[MODEL_PARAMETERS_AT + {{ NAME }}_ROWS + i];
    }
    {{ name }}_start(&m->inside, &settings, m->value[MODEL_INPUTS_AT]);
    show(m);
}

int model_step(model *m, double step)
{
    const double count = floor(step / MODEL_SAMPLE_TIME + 0.5);
    if (!(count >= 1.0) || fabs(step / MODEL_SAMPLE_TIME - count) > 1e-6) {
        return 0;
    }
    m->inside.drive = m->value[MODEL_INPUTS_AT];
    for (double k = 1.0; k <= count; k += 1.0) {
        {{ name }}_step(&m->inside, m->value[MODEL_INPUTS_AT] + k * MODEL_SAMPLE_TIME * m->slope[0]);
    }
    m->slope[0] = 0.0;
    m->value[0] += step;
    show(m);
    return 1;
}
