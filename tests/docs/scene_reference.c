/* Prints docs/scene_reference.md: what is written by hand there, then the tables of keys. */
#include <stdio.h>
#include <string.h>

#include "scene/options.h"

static const char marker[] = "<!-- made from the tables of keys -->";

static void print_line(const struct gbg_option *option)
{
    char line[1024];
    snprintf(line, sizeof line, "%s", option->line);
    char *field = line;
    fputs("|", stdout);
    for (int column = 0; column < 5; column++) {
        size_t length = strcspn(field, "|");
        char *rest = field[length] ? field + length + 1 : field + length;
        field[length] = 0;
        printf(column == 0 ? " `%s` |" : " %s |", field);
        field = rest;
    }
    puts("");
}

static void print_table(const char *title, const struct gbg_option *table)
{
    printf("\n## %s\n\n| key | type | default | range | meaning |\n|---|---|---|---|---|\n", title);
    for (; table->name; table++) {
        print_line(table);
    }
}

int main(int count, char **arguments)
{
    char line[1024];
    FILE *document = count == 2 ? fopen(arguments[1], "r") : NULL;
    if (!document) {
        fputs("use: scene_reference docs/scene_reference.md\n", stderr);
        return 2;
    }
    do {
        if (!fgets(line, sizeof line, document)) {
            fprintf(stderr, "no line \"%s\" in %s\n", marker, arguments[1]);
            return 1;
        }
        fputs(line, stdout);
    } while (strncmp(line, marker, strlen(marker)) != 0);
    fclose(document);
    print_table("Options: scene files and calls", gbg_scene_options);
    print_table("Only in scene files", gbg_file_options);
    print_table("An entry of particles.species", gbg_species_options);
    print_table("An entry of forces", gbg_force_options);
    return 0;
}
