/* written by erls: what the files of a co-simulation unit share (see unit.c). */

#ifndef ERLS_UNIT_H
#define ERLS_UNIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#define DOOR __attribute__((visibility("default")))

enum { OK = 0, WARNING = 1, DISCARD = 2, ERROR = 3, FATAL = 4 };

typedef uint32_t Reference;
typedef void (*Logger3)(void *environment, int status, const char *category, const char *message);
typedef void (*Logger2)(void *environment, const char *instance, int status, const char *category,
                        const char *message, ...);

typedef struct {
    char *name;
    void *environment;
    Logger3 logger3;
    Logger2 logger2;
    pid_t process;
    int socket; /* -1: broken */
    uint64_t inputs, outputs;
    double *values; /* time, inputs, outputs */
} Unit;

/* NULL, and a message, where there is none. */
Unit *unit_begin(const char *name, const char *token, const char *folder, void *environment, Logger3 logger3,
                 Logger2 logger2);
void unit_end(Unit *unit);

/* Each gives a status, after a message where that is no OK. */
int unit_reset(Unit *unit);
int unit_begins_at(Unit *unit, double time);
int unit_get(Unit *unit, const Reference *references, size_t count, double *values);
int unit_set(Unit *unit, const Reference *references, size_t count, const double *values);
int unit_step(Unit *unit, double time, double length);
int unit_keep(Unit *unit, void **state);
int unit_go(Unit *unit, void *state);
int unit_forget(Unit *unit, void **state);
int unit_refuse(Unit *unit, const char *function);

/* A function that this unit does not have. */
#define NOT(function) \
    DOOR int function(Unit *unit) { return unit_refuse(unit, #function); }

/* Variables of a type that there are none of: asking for none of them is right. */
#define NONE(version, type)                                                                                      \
    DOOR int version##Get##type(Unit *unit, const Reference *references, size_t count) {                         \
        return (void)references, count ? unit_refuse(unit, #version "Get" #type) : OK;                           \
    }                                                                                                            \
    DOOR int version##Set##type(Unit *unit, const Reference *references, size_t count) {                         \
        return (void)references, count ? unit_refuse(unit, #version "Set" #type) : OK;                           \
    }

#endif
