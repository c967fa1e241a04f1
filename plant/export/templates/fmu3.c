/* FMI 3.0 for co-simulation around the model inside. */
#include "model.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
#if defined(_WIN32)
#undef API
#define API __declspec(dllexport)
#endif

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status;
typedef void *component;
typedef uint32_t reference;

{% set types = (("Float32", "float"), ("Int8", "int8_t"), ("UInt8", "uint8_t"), ("Int16", "int16_t"), ("UInt16", "uint16_t"), ("Int32", "int32_t"), ("UInt32", "uint32_t"), ("Int64", "int64_t"), ("UInt64", "uint64_t"), ("Boolean", "bool"), ("String", "const char *")) %}
API const char *fmi3GetVersion(void);
API status fmi3SetDebugLogging(component c, bool on, size_t count, const char *const names[]);
API component fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                          bool logging, bool events, bool early, const reference vr[], size_t count,
                                          void *environment, void (*log)(void), void (*update)(void));
API component fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                           bool logging, void *environment, void (*log)(void));
API component fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                                bool logging, void *environment, void (*log)(void), void (*clock)(void),
                                                void (*lock)(void), void (*unlock)(void));
API void fmi3FreeInstance(component c);
API status fmi3EnterInitializationMode(component c, bool has_tolerance, double tolerance, double start, bool has_stop,
                                       double stop);
API status fmi3GetFloat64(component c, const reference vr[], size_t count, double value[], size_t values);
API status fmi3SetFloat64(component c, const reference vr[], size_t count, const double value[], size_t values);
API status fmi3DoStep(component c, double time, double step, bool no_return, bool *event, bool *terminate, bool *early,
                      double *last);
API status fmi3GetFMUState(component c, void **kept);
API status fmi3SetFMUState(component c, void *kept);
API status fmi3FreeFMUState(component c, void **kept);
API status fmi3SerializedFMUStateSize(component c, void *kept, size_t *size);
API status fmi3SerializeFMUState(component c, void *kept, uint8_t bytes[], size_t size);
API status fmi3DeserializeFMUState(component c, const uint8_t bytes[], size_t size, void **kept);
{% for type, c_type in types %}
API status fmi3Get{{ type }}(component c, const reference vr[], size_t count, {{ c_type }} value[], size_t values);
API status fmi3Set{{ type }}(component c, const reference vr[], size_t count, const {{ c_type }} value[], size_t values);
{% endfor %}
{% set whole = ("ExitInitializationMode", "EnterEventMode", "EnterStepMode", "Terminate", "Reset", "EnterConfigurationMode", "ExitConfigurationMode", "EnterContinuousTimeMode", "EvaluateDiscreteStates") %}
{% for what in whole %}
API status fmi3{{ what }}(component c);
{% endfor %}
{% set absent = ("GetBinary", "SetBinary", "GetClock", "SetClock", "GetNumberOfVariableDependencies", "GetVariableDependencies", "GetDirectionalDerivative", "GetAdjointDerivative", "GetIntervalDecimal", "GetIntervalFraction", "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal", "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction", "UpdateDiscreteStates", "CompletedIntegratorStep", "SetTime", "SetContinuousStates", "GetContinuousStateDerivatives", "GetEventIndicators", "GetContinuousStates", "GetNominalsOfContinuousStates", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates", "GetOutputDerivatives", "ActivateModelPartition") %}
{% for what in absent %}
API status fmi3{{ what }}(component c);
{% endfor %}

const char *fmi3GetVersion(void)
{
    return "3.0";
}

status fmi3SetDebugLogging(component c, bool on, size_t count, const char *const names[])
{
    (void)c;
    (void)on;
    (void)count;
    (void)names;
    return OK;
}

component fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                      bool logging, bool events, bool early, const reference vr[], size_t count,
                                      void *environment, void (*log)(void), void (*update)(void))
{
    model *m = (!events && token != NULL && strcmp(token, MODEL_TOKEN) == 0) ? calloc(1, sizeof *m) : NULL;
    (void)name;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)early;
    (void)vr;
    (void)count;
    (void)environment;
    (void)log;
    (void)update;
    if (m != NULL) {
        model_reset(m);
    }
    return m;
}

component fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                       bool logging, void *environment, void (*log)(void))
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    return NULL;
}

component fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                            bool logging, void *environment, void (*log)(void), void (*clock)(void),
                                            void (*lock)(void), void (*unlock)(void))
{
    (void)clock;
    (void)lock;
    (void)unlock;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
}

void fmi3FreeInstance(component c)
{
    free(c);
}

status fmi3EnterInitializationMode(component c, bool has_tolerance, double tolerance, double start, bool has_stop,
                                   double stop)
{
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    ((model *)c)->value[0] = start;
    return OK;
}

status fmi3GetFloat64(component c, const reference vr[], size_t count, double value[], size_t values)
{
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] >= MODEL_VALUES || i >= values) {
            return ERROR;
        }
        value[i] = ((model *)c)->value[vr[i]];
    }
    return OK;
}

status fmi3SetFloat64(component c, const reference vr[], size_t count, const double value[], size_t values)
{
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] < MODEL_PARAMETERS_AT || vr[i] >= MODEL_OUTPUTS_AT || i >= values) {
            return ERROR;
        }
        ((model *)c)->value[vr[i]] = value[i];
    }
    return OK;
}

status fmi3DoStep(component c, double time, double step, bool no_return, bool *event, bool *terminate, bool *early,
                  double *last)
{
    (void)no_return;
    *event = false;
    *terminate = false;
    *early = false;
    *last = time;
    if (!model_step(c, step)) {
        return ERROR;
    }
    *last = time + step;
    return OK;
}

status fmi3GetFMUState(component c, void **kept)
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

status fmi3SetFMUState(component c, void *kept)
{
    memcpy(c, kept, sizeof(model));
    return OK;
}

status fmi3FreeFMUState(component c, void **kept)
{
    (void)c;
    free(*kept);
    *kept = NULL;
    return OK;
}

status fmi3SerializedFMUStateSize(component c, void *kept, size_t *size)
{
    (void)c;
    (void)kept;
    *size = sizeof(model);
    return OK;
}

status fmi3SerializeFMUState(component c, void *kept, uint8_t bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(model)) {
        return ERROR;
    }
    memcpy(bytes, kept, sizeof(model));
    return OK;
}

status fmi3DeserializeFMUState(component c, const uint8_t bytes[], size_t size, void **kept)
{
    if (size != sizeof(model) || fmi3GetFMUState(c, kept) != OK) {
        return ERROR;
    }
    memcpy(*kept, bytes, sizeof(model));
    return OK;
}

/* There are real values alone. */
{% for type, c_type in types %}
status fmi3Get{{ type }}(component c, const reference vr[], size_t count, {{ c_type }} value[], size_t values)
{
    (void)c;
    (void)vr;
    (void)value;
    (void)values;
    return (count == 0) ? OK : ERROR;
}

status fmi3Set{{ type }}(component c, const reference vr[], size_t count, const {{ c_type }} value[], size_t values)
{
    (void)c;
    (void)vr;
    (void)value;
    (void)values;
    return (count == 0) ? OK : ERROR;
}

{% endfor %}
{% for what in whole %}
status fmi3{{ what }}(component c)
{
{% if what == "ExitInitializationMode" %}
    model_begin(c);
{% elif what == "Reset" %}
    model_reset(c);
{% else %}
    (void)c;
{% endif %}
    return OK;
}

{% endfor %}
/* What no capability flag of the model description announces; a caller's further arguments are not looked at. */
{% for what in absent %}
status fmi3{{ what }}(component c)
{
    (void)c;
    return ERROR;
}

{% endfor %}
