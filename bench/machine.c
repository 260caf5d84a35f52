/* Benchmarks: on what machine, and of what commit, a figure was measured. */
#include "bench/machine.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "commit.h"

static void read_model(char *model, size_t capacity)
{
    char line[512];
    snprintf(model, capacity, "unknown processor");
    FILE *file = fopen("/proc/cpuinfo", "r");
    while (file && fgets(line, sizeof line, file)) {
        char *value = strchr(line, ':');
        if (value && strncmp(line, "model name", 10) == 0) {
            value += 1 + strspn(value + 1, " ");
            value[strcspn(value, "\"\\\n")] = 0;
            snprintf(model, capacity, "%s", value);
            break;
        }
    }
    if (file) {
        fclose(file);
    }
}

void gbg_machine_look(struct gbg_machine *machine)
{
    read_model(machine->model, sizeof machine->model);
    machine->cores = (int)sysconf(_SC_NPROCESSORS_ONLN);
    machine->load = -1.0;
    FILE *file = fopen("/proc/loadavg", "r");
    if (file) {
        if (fscanf(file, "%lf", &machine->load) != 1) {
            machine->load = -1.0;
        }
        fclose(file);
    }
}

const char *gbg_machine_commit(void)
{
    return GBG_COMMIT;
}
