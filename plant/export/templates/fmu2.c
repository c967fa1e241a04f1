/* FMI 2.0 for co-simulation around the model inside. */
#include "model.h"

#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
#if defined(_WIN32)
#undef API
#define API __declspec(dllexport)
#endif

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status;
typedef void *component;
typedef unsigned int reference;

API const char *fmi2GetTypesPlatform(void);
API const char *fmi2GetVersion(void);
API status fmi2SetDebugLogging(component c, int on, size_t count, const char *const names[]);
API component fmi2Instantiate(const char *name, int type, const char *token, const char *resources, const void *functions,
                              int visible, int logging);
API void fmi2FreeInstance(component c);
API status fmi2SetupExperiment(component c, int has_tolerance, double tolerance, double start, int has_stop, double stop);
API status fmi2EnterInitializationMode(component c);
API status fmi2ExitInitializationMode(component c);
API status fmi2Terminate(component c);
API status fmi2Reset(component c);
API status fmi2GetReal(component c, const reference vr[], size_t count, double value[]);
API status fmi2SetReal(component c, const reference vr[], size_t count, const double value[]);
API status fmi2SetRealInputDerivatives(component c, const reference vr[], size_t count, const int order[],
                                       const double value[]);
API status fmi2GetRealOutputDerivatives(component c, const reference vr[], size_t count, const int order[],
                                        double value[]);
API status fmi2DoStep(component c, double time, double step, int no_return);
API status fmi2CancelStep(component c);
API status fmi2GetFMUstate(component c, void **kept);
API status fmi2SetFMUstate(component c, void *kept);
API status fmi2FreeFMUstate(component c, void **kept);
API status fmi2SerializedFMUstateSize(component c, void *kept, size_t *size);
API status fmi2SerializeFMUstate(component c, void *kept, char bytes[], size_t size);
API status fmi2DeSerializeFMUstate(component c, const char bytes[], size_t size, void **kept);
API status fmi2GetDirectionalDerivative(component c, const reference unknown[], size_t unknowns, const reference known[],
                                        size_t knowns, const double seed[], double change[]);

{% for type, c_type in (("Integer", "int"), ("Boolean", "int"), ("String", "const char *")) %}
API status fmi2Get{{ type }}(component c, const reference vr[], size_t count, {{ c_type }} value[]);
API status fmi2Set{{ type }}(component c, const reference vr[], size_t count, const {{ c_type }} value[]);
{% endfor %}
{% for what, c_type in (("Status", "status"), ("RealStatus", "double"), ("IntegerStatus", "int"), ("BooleanStatus", "int"), ("StringStatus", "const char *")) %}
API status fmi2Get{{ what }}(component c, int kind, {{ c_type }} *value);
{% endfor %}

const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

const char *fmi2GetVersion(void)
{
    return "2.0";
}

status fmi2SetDebugLogging(component c, int on, size_t count, const char *const names[])
{
    (void)c;
    (void)on;
    (void)count;
    (void)names;
    return OK;
}

component fmi2Instantiate(const char *name, int type, const char *token, const char *resources, const void *functions,
                          int visible, int logging)
{
    model *m = (type == 1 && token != NULL && strcmp(token, MODEL_TOKEN) == 0) ? calloc(1, sizeof *m) : NULL;
    (void)name;
    (void)resources;
    (void)functions;
    (void)visible;
    (void)logging;
    if (m != NULL) {
        model_reset(m);
    }
    return m;
}

void fmi2FreeInstance(component c)
{
    free(c);
}

status fmi2SetupExperiment(component c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    ((model *)c)->value[0] = start;
    return OK;
}

status fmi2EnterInitializationMode(component c)
{
    (void)c;
    return OK;
}

status fmi2ExitInitializationMode(component c)
{
    model_begin(c);
    return OK;
}

status fmi2Terminate(component c)
{
    (void)c;
    return OK;
}

status fmi2Reset(component c)
{
    model_reset(c);
    return OK;
}

status fmi2GetReal(component c, const reference vr[], size_t count, double value[])
{
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] >= MODEL_VALUES) {
            return ERROR;
        }
        value[i] = ((model *)c)->value[vr[i]];
    }
    return OK;
}

status fmi2SetReal(component c, const reference vr[], size_t count, const double value[])
{
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] < MODEL_PARAMETERS_AT || vr[i] >= MODEL_OUTPUTS_AT) {
            return ERROR;
        }
        ((model *)c)->value[vr[i]] = value[i];
    }
    return OK;
}

status fmi2SetRealInputDerivatives(component c, const reference vr[], size_t count, const int order[],
                                   const double value[])
{
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] < MODEL_INPUTS_AT || vr[i] >= MODEL_OUTPUTS_AT || order[i] != 1) {
            return ERROR;
        }
        ((model *)c)->slope[vr[i] - MODEL_INPUTS_AT] = value[i];
    }
    return OK;
}

status fmi2GetRealOutputDerivatives(component c, const reference vr[], size_t count, const int order[], double value[])
{
    (void)c;
    (void)vr;
    (void)count;
    (void)order;
    (void)value;
    return ERROR;
}

status fmi2DoStep(component c, double time, double step, int no_return)
{
    (void)time;
    (void)no_return;
    return model_step(c, step) ? OK : ERROR;
}

status fmi2CancelStep(component c)
{
    (void)c;
    return ERROR;
}

status fmi2GetFMUstate(component c, void **kept)
{
    if (*kept == NULL) {
        *kept = malloc(sizeof(model));
    }
    if (*kept == NULL) {
        return ERROR;
    }
    memcpy(*kept, c, sizeof(model));
    return OK;
}

status fmi2SetFMUstate(component c, void *kept)
{
    memcpy(c, kept, sizeof(model));
    return OK;
}

status fmi2FreeFMUstate(component c, void **kept)
{
    (void)c;
    free(*kept);
    *kept = NULL;
    return OK;
}

status fmi2SerializedFMUstateSize(component c, void *kept, size_t *size)
{
    (void)c;
    (void)kept;
    *size = sizeof(model);
    return OK;
}

status fmi2SerializeFMUstate(component c, void *kept, char bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(model)) {
        return ERROR;
    }
    memcpy(bytes, kept, sizeof(model));
    return OK;
}

status fmi2DeSerializeFMUstate(component c, const char bytes[], size_t size, void **kept)
{
    if (size != sizeof(model) || fmi2GetFMUstate(c, kept) != OK) {
        return ERROR;
    }
    memcpy(*kept, bytes, sizeof(model));
    return OK;
}

status fmi2GetDirectionalDerivative(component c, const reference unknown[], size_t unknowns, const reference known[],
                                    size_t knowns, const double seed[], double change[])
{
    (void)c;
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)seed;
    (void)change;
    return ERROR;
}

/* There are real values alone. */
{% for type, c_type in (("Integer", "int"), ("Boolean", "int"), ("String", "const char *")) %}
status fmi2Get{{ type }}(component c, const reference vr[], size_t count, {{ c_type }} value[])
{
    (void)c;
    (void)vr;
    (void)value;
    return (count == 0) ? OK : ERROR;
}

status fmi2Set{{ type }}(component c, const reference vr[], size_t count, const {{ c_type }} value[])
{
    (void)c;
    (void)vr;
    (void)value;
    return (count == 0) ? OK : ERROR;
}

{% endfor %}
/* Steps end before they return. */
{% for what, c_type in (("Status", "status"), ("RealStatus", "double"), ("IntegerStatus", "int"), ("BooleanStatus", "int"), ("StringStatus", "const char *")) %}
status fmi2Get{{ what }}(component c, int kind, {{ c_type }} *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return DISCARD;
}

{% endfor %}
