/* written by erls: a co-simulation unit, FMI 3.0 and 2.0.

   The unit is a door: it starts a process of Python that holds the mechanism (erls.fmi.serve), and asks it over a socket
   pair. So it lives in any program, next to any other unit, and needs erls where it runs. POSIX.

   resources/unit.txt holds four lines: token, number of inputs, number of outputs, interpreter. Value references: 0 is
   time, then inputs, then outputs, all of them real numbers.

   Messages are in the machine's own byte order. Asked: one letter, then
     b  -                        begin at time 0
     s  t, h, inputs (doubles)   a step
     v  -                        keep the state: answers its number (uint64)
     g  number                   go to a kept state
     f  number                   forget it
   Answered: status and length of a text (uint32 each), the text, and where the status is 0 what was asked for: after
   b, s and g the outputs (doubles). */

#define _DEFAULT_SOURCE
#define _DARWIN_C_SOURCE
#include "unit.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef MSG_NOSIGNAL
#define SEND_FLAGS MSG_NOSIGNAL
#else
#define SEND_FLAGS 0 /* SO_NOSIGPIPE of the socket instead */
#endif

extern char **environ;

/* ---- messages ------------------------------------------------------------------------------------------------- */

static int say(Unit *unit, int status, const char *text) {
    const char *category = status >= FATAL ? "logStatusFatal" : status == WARNING ? "logStatusWarning" : "logStatusError";
    if (unit->logger3) unit->logger3(unit->environment, status, category, text);
    if (unit->logger2) unit->logger2(unit->environment, unit->name, status, category, "%s", text);
    return status;
}

static int lost(Unit *unit) {
    if (unit->socket >= 0) close(unit->socket);
    unit->socket = -1;
    return say(unit, FATAL, "the process that holds the mechanism has ended: is erls installed for this Python "
                            "(ERLS_PYTHON names another one)?");
}

static bool give(Unit *unit, const void *data, size_t size) {
    const char *at = data;
    while (size) {
        ssize_t sent = send(unit->socket, at, size, SEND_FLAGS);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        at += sent, size -= (size_t)sent;
    }
    return true;
}

static bool take(Unit *unit, void *data, size_t size) {
    char *at = data;
    while (size) {
        ssize_t got = recv(unit->socket, at, size, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got, size -= (size_t)got;
    }
    return true;
}

static int answer(Unit *unit, void *result, size_t size) {
    uint32_t head[2];
    if (!take(unit, head, sizeof head)) return lost(unit);
    if (head[1]) {
        char *text = calloc(head[1] + 1u, 1);
        if (!text || !take(unit, text, head[1])) {
            free(text);
            return lost(unit);
        }
        say(unit, head[0] ? ERROR : WARNING, text);
        free(text);
    }
    if (head[0]) return ERROR;
    return take(unit, result, size) ? OK : lost(unit);
}

static int ask(Unit *unit, char letter, const void *data, size_t size, void *result, size_t length) {
    if (unit->socket < 0) return FATAL;
    if (!give(unit, &letter, 1) || !give(unit, data, size)) return lost(unit);
    return answer(unit, result, length);
}

static double *outputs(Unit *unit) { return unit->values + 1 + unit->inputs; }

static size_t output_bytes(Unit *unit) { return unit->outputs * sizeof(double); }

/* ---- birth and death ------------------------------------------------------------------------------------------ */

static bool line(FILE *file, char *text, size_t size) {
    if (!fgets(text, (int)size, file)) return false;
    text[strcspn(text, "\r\n")] = 0;
    return true;
}

static bool start(Unit *unit, const char *python, const char *folder) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return false;
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
#ifdef SO_NOSIGPIPE
    int one = 1;
    setsockopt(ends[0], SOL_SOCKET, SO_NOSIGPIPE, &one, sizeof one);
#endif
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 0);
    posix_spawn_file_actions_adddup2(&actions, 2, 1); /* what is printed goes to stderr */
    char *arguments[] = {(char *)python, "-m", "erls.fmi.serve", (char *)folder, NULL};
    int failed = posix_spawnp(&unit->process, python, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (failed) {
        close(ends[0]);
        unit->process = 0;
        return false;
    }
    unit->socket = ends[0];
    return true;
}

void unit_end(Unit *unit) {
    if (!unit) return;
    if (unit->socket >= 0) close(unit->socket); /* at which the process ends */
    if (unit->process > 0)
        while (waitpid(unit->process, NULL, 0) < 0 && errno == EINTR) continue;
    free(unit->values);
    free(unit->name);
    free(unit);
}

Unit *unit_begin(const char *name, const char *token, const char *folder, void *environment, Logger3 logger3,
                   Logger2 logger2) {
    char path[4096], own[256], count[2][64], python[4096];
    Unit *unit = calloc(1, sizeof *unit);
    if (!unit) return NULL;
    unit->socket = -1, unit->environment = environment, unit->logger3 = logger3, unit->logger2 = logger2;
    unit->name = strdup(name ? name : "");
    snprintf(path, sizeof path, "%s/unit.txt", folder ? folder : "");
    FILE *file = folder ? fopen(path, "r") : NULL;
    bool read = file && line(file, own, sizeof own) && line(file, count[0], sizeof count[0]) &&
                line(file, count[1], sizeof count[1]) && line(file, python, sizeof python);
    if (file) fclose(file);
    if (!read) {
        say(unit, ERROR, "the resources of the unit are not where the importer says");
    } else if (!token || strcmp(token, own)) {
        say(unit, ERROR, "the token is that of another unit");
    } else {
        unit->inputs = strtoull(count[0], NULL, 10), unit->outputs = strtoull(count[1], NULL, 10);
        unit->values = calloc(1 + unit->inputs + unit->outputs, sizeof(double));
        const char *given = getenv("ERLS_PYTHON");
        const char *chosen = given && *given ? given : access(python, X_OK) == 0 ? python : "python3";
        if (!unit->values || !start(unit, chosen, folder))
            say(unit, ERROR, "no Python can be started: set ERLS_PYTHON to one that has erls");
        else if (answer(unit, NULL, 0) == OK && ask(unit, 'b', NULL, 0, outputs(unit), output_bytes(unit)) == OK)
            return unit;
    }
    unit_end(unit);
    return NULL;
}

/* ---- what both versions do ------------------------------------------------------------------------------------ */

int unit_reset(Unit *unit) {
    memset(unit->values, 0, (1 + unit->inputs) * sizeof(double));
    return ask(unit, 'b', NULL, 0, outputs(unit), output_bytes(unit));
}

int unit_begins_at(Unit *unit, double time) {
    if (time != 0.0) return say(unit, ERROR, "a scene begins at time 0: start the simulation there");
    return OK;
}

int unit_get(Unit *unit, const Reference *references, size_t count, double *values) {
    for (size_t k = 0; k < count; k++) {
        if (references[k] > unit->inputs + unit->outputs) return say(unit, ERROR, "no variable of that value reference");
        values[k] = unit->values[references[k]];
    }
    return OK;
}

int unit_set(Unit *unit, const Reference *references, size_t count, const double *values) {
    for (size_t k = 0; k < count; k++) {
        if (references[k] < 1 || references[k] > unit->inputs) return say(unit, ERROR, "only inputs can be set");
        if (!isfinite(values[k])) return say(unit, ERROR, "an input is not a finite number");
    }
    for (size_t k = 0; k < count; k++) unit->values[references[k]] = values[k];
    return OK;
}

int unit_step(Unit *unit, double time, double length) {
    size_t size = (2 + unit->inputs) * sizeof(double);
    double *asked = malloc(size);
    if (!asked) return ERROR;
    asked[0] = time, asked[1] = length;
    memcpy(asked + 2, unit->values + 1, unit->inputs * sizeof(double));
    int status = ask(unit, 's', asked, size, outputs(unit), output_bytes(unit));
    free(asked);
    if (status == OK) unit->values[0] = time + length;
    return status;
}

typedef struct {
    uint64_t number;
    double values[]; /* time and inputs */
} State;

int unit_keep(Unit *unit, void **state) {
    size_t size = (1 + unit->inputs) * sizeof(double);
    State *kept = malloc(sizeof *kept + size);
    if (!kept) return ERROR;
    int status = ask(unit, 'v', NULL, 0, &kept->number, sizeof kept->number);
    if (status != OK) {
        free(kept);
        return status;
    }
    memcpy(kept->values, unit->values, size);
    if (*state) { /* of an earlier call: it may be overwritten */
        State *old = *state;
        ask(unit, 'f', &old->number, sizeof old->number, NULL, 0);
        free(old);
    }
    *state = kept;
    return OK;
}

int unit_go(Unit *unit, void *given) {
    State *state = given;
    if (!state) return say(unit, ERROR, "no state");
    int status = ask(unit, 'g', &state->number, sizeof state->number, outputs(unit), output_bytes(unit));
    if (status == OK) memcpy(unit->values, state->values, (1 + unit->inputs) * sizeof(double));
    return status;
}

int unit_forget(Unit *unit, void **state) {
    if (!state || !*state) return OK;
    State *old = *state;
    int status = ask(unit, 'f', &old->number, sizeof old->number, NULL, 0);
    free(old);
    *state = NULL;
    return status;
}

int unit_refuse(Unit *unit, const char *function) {
    char text[200];
    snprintf(text, sizeof text, "%s: this unit has nothing of the kind", function);
    return say(unit, ERROR, text);
}
