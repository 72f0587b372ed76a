/* FMU states: the whole instance as one block of plain data. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

struct Saved {
    uint64_t zero;     /* stays 0: some importers pass the block itself to a function that frees the pointer at its start */
    uint32_t magic;    /* marks a block of this format and byte order */
    uint32_t size;
    uint64_t origin;   /* hash of the instantiation token: refuses blocks of another FMU */
    uint64_t checksum; /* of a serialized block: checksum of all that follows */
    int32_t kind, mode, unprepared, refused;
    double start_time;
    Model model;
};

static const uint32_t MAGIC = 0x55565331;

/* FNV-1a */
static uint64_t hash(const void *data, size_t size)
{
    const unsigned char *bytes = data;
    uint64_t value = 14695981039346656037u;

    for (size_t i = 0; i < size; i++)
        value = (value ^ bytes[i]) * 1099511628211u;
    return value;
}

static uint64_t checksum(const Saved *saved)
{
    const size_t start = offsetof(Saved, kind);

    return hash((const char *)saved + start, sizeof *saved - start);
}

static Status check_block(const Instance *instance, const Saved *saved)
{
    if (saved->zero != 0 || saved->magic != MAGIC || saved->size != sizeof *saved ||
        saved->origin != hash(TOKEN, strlen(TOKEN)))
        return instance_refuse(instance, "FMU state is of another FMU, or damaged");
    return STATUS_OK;
}

Status instance_save(Instance *instance, Saved **saved)
{
    if (*saved && check_block(instance, *saved) != STATUS_OK) /* an existing block is overwritten */
        return STATUS_ERROR;
    if (!*saved)
        *saved = calloc(1, sizeof **saved);
    if (!*saved)
        return instance_refuse(instance, "no memory for an FMU state");

    Saved *s = *saved;
    s->magic = MAGIC;
    s->size = sizeof *s;
    s->origin = hash(TOKEN, strlen(TOKEN));
    s->kind = (int32_t)instance->kind;
    s->mode = (int32_t)instance->mode;
    s->unprepared = instance->unprepared;
    s->refused = instance->refused;
    s->start_time = instance->start_time;
    memcpy(&s->model, &instance->model, sizeof s->model);
    return STATUS_OK;
}

Status instance_restore(Instance *instance, const Saved *saved)
{
    if (check_block(instance, saved) != STATUS_OK)
        return STATUS_ERROR;
    if (saved->kind != (int32_t)instance->kind)
        return instance_refuse(instance, "FMU state is of the other interface (co-simulation or model exchange)");
    if (saved->kind == CO_SIMULATION && saved->mode == MODE_EVENT && !instance->has_event_mode)
        return instance_refuse(instance, "FMU state is in event mode, which this instance does not use");
    memcpy(&instance->model, &saved->model, sizeof instance->model);
    instance->mode = (Mode)saved->mode;
    instance->unprepared = saved->unprepared != 0;
    instance->refused = saved->refused != 0;
    instance->start_time = saved->start_time;
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_free_saved(Instance *instance, Saved **saved)
{
    if (!saved || !*saved)
        return STATUS_OK;
    if (check_block(instance, *saved) != STATUS_OK)
        return STATUS_ERROR;
    (*saved)->magic = 0;
    free(*saved);
    *saved = NULL;
    return STATUS_OK;
}

Status instance_serialized_size(Instance *instance, const Saved *saved, size_t *size)
{
    if (check_block(instance, saved) != STATUS_OK)
        return STATUS_ERROR;
    *size = sizeof *saved;
    return STATUS_OK;
}

Status instance_serialize(Instance *instance, const Saved *saved, unsigned char bytes[], size_t size)
{
    if (check_block(instance, saved) != STATUS_OK)
        return STATUS_ERROR;
    if (size < sizeof *saved)
        return instance_refuse(instance, "serializing: %zu bytes given, %zu needed", size, sizeof *saved);
    memcpy(bytes, saved, sizeof *saved);
    const uint64_t sum = checksum(saved);
    memcpy(bytes + offsetof(Saved, checksum), &sum, sizeof sum);
    return STATUS_OK;
}

/* Checks a state that was read: every value finite and in its range, the rest by the component. */
static Status check_content(const Instance *instance, const Saved *saved)
{
    const Model *m = &saved->model;
    const Variable *invalid = variables_first_invalid(m);
    bool valid = fabs(m->time) <= MAX_TIME && fabs(saved->start_time) <= MAX_TIME && saved->start_time <= m->time &&
                !isnan(m->stop_time) && COMPONENT.valid_state(m);

    if (invalid)
        return instance_refuse(instance, "serialized FMU state: %s is outside [%.9g, %.9g]", invalid->name, invalid->min,
                               invalid->max);
    const int32_t modes[] = {MODE_INSTANTIATED, MODE_INITIALIZING, MODE_TERMINATED, MODE_STEPPING, MODE_EVENT, MODE_CONTINUOUS};
    bool known = false; /* each of the last three belongs to one interface */
    for (int i = 0; i < 6; i++)
        known = known || (saved->mode == modes[i] && (i < 3 || (i == 3) == (saved->kind == CO_SIMULATION) ||
                                                      (i == 4 && N_CLOCK_VARIABLES > 0)));
    valid = valid && known;
    return valid ? STATUS_OK : instance_refuse(instance, "serialized FMU state is invalid: a time, mode or held value is out of range");
}

Status instance_deserialize(Instance *instance, const unsigned char bytes[], size_t size, Saved **saved)
{
    if (size != sizeof **saved)
        return instance_refuse(instance, "serialized FMU state has %zu bytes, expected %zu", size, sizeof **saved);
    Saved *s = malloc(sizeof *s);
    if (!s)
        return instance_refuse(instance, "no memory for an FMU state");
    memcpy(s, bytes, sizeof *s);
    Status status = check_block(instance, s);
    if (status == STATUS_OK && s->checksum != checksum(s))
        status = instance_refuse(instance, "serialized FMU state is damaged: its checksum does not fit");
    if (status == STATUS_OK)
        status = check_content(instance, s);
    if (status != STATUS_OK) {
        free(s);
        return status;
    }
    s->checksum = 0;
    s->unprepared = 1; /* constants are computed from the parameters, not read */
    *saved = s;
    return STATUS_OK;
}
