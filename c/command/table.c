/* Command: all commands and their options: what is parsed, checked and printed as help. */
#include "command/command.h"

#define MOST 9007199254740992.0

/* clang-format off */
#define BACKEND {"backend", "NAME", "cpu, poison, cuda:N or auto (default): a GPU if there is one", GBG_TEXT, 0, 0, 0}
#define THREADS {"threads", "N", "threads (default: the machine's)", GBG_INTEGER, 1, 1024, 0}
#define FIRST {"first", "I", "first frame, from 0 (default 0)", GBG_INTEGER, 0, MOST, 0}
#define LAST {"last", "I", "last frame (default: that of the file)", GBG_INTEGER, 0, MOST, 0}
#define STRIDE {"stride", "N", "every N-th frame (default 1)", GBG_INTEGER, 1, MOST, 0}
#define PICTURE {"out", "P.png", "picture; the suffix .png or .svg decides", GBG_TEXT, 0, 0, 1}
#define WIDTH {"width", "PX", "width in pixels (default 1200)", GBG_INTEGER, 200, 16000, 0}
#define END {.name = NULL}

const struct gbg_command gbg_commands[] = {
    {"check", "SCENE", "validates a scene and prints what it resolves to, and the plan",
     gbg_command_check,
     {BACKEND, THREADS, END}},
    {"run", "SCENE", "simulates a scene",
     gbg_command_run,
     {BACKEND, THREADS,
      {"steps", "N", "step at which the run ends (default: the scene's)", GBG_INTEGER, 0, MOST, 0},
      {"out", "T.nc", "trajectory (default: the scene's)", GBG_TEXT, 0, 0, 0},
      {"restart", "R", "goes on from a restart file, and with its trajectory", GBG_TEXT, 0, 0, 0},
      {"seed", "S", "seed of the noise (default: the scene's)", GBG_INTEGER, 0, 4294967295.0, 0},
      {"hash", NULL, "prints the SHA-256 of the final state", GBG_FLAG, 0, 0, 0},
      {"json", "F", "file for the summary: speed, rounds, counters, errors", GBG_TEXT, 0, 0, 0},
      {"quiet", NULL, "prints errors only", GBG_FLAG, 0, 0, 0},
      END}},
    {"verify", "T.nc", "checks a trajectory by code that is not the solver's",
     gbg_command_verify,
     {FIRST, LAST, STRIDE,
      {"most", "N", "violations to print (default 5)", GBG_INTEGER, 0, 1e9, 0},
      END}},
    {"forces", "SCENE", "writes the forces on the start of a scene",
     gbg_command_forces,
     {BACKEND, THREADS,
      {"out", "F.nc", "netCDF file of forces, positions and species", GBG_TEXT, 0, 0, 1},
      END}},
    {"sk", "T.nc", "structure factor of a trajectory, with its errors",
     gbg_command_sk,
     {{"out", "S.nc", "netCDF-4 file of S(k)", GBG_TEXT, 0, 0, 1},
      {"kmax", "K", "largest wave number (default: 8 pi over the mean distance)", GBG_REAL,
       1e-300, 1e300, 0},
      {"tolerance", "E", "bound of the error of rho(k)/sqrt(N) (default 1e-6)", GBG_REAL, 1e-15,
       0.1, 0},
      {"types", NULL, "partial structure factors of all pairs of species too", GBG_FLAG, 0, 0, 0},
      {"method", "auto|mesh|direct", "how (default auto)", GBG_CHOICE, 0, 0, 0},
      FIRST, LAST, STRIDE, THREADS, END}},
    {"render", "T.nc", "draws a frame, discs to scale",
     gbg_command_render,
     {PICTURE, WIDTH,
      {"frame", "I", "frame, from 0; -1 the last (default)", GBG_INTEGER, -1, MOST, 0},
      {"colour", "type|overlap", "by species (default) or by having taken part in an overlap",
       GBG_CHOICE, 0, 0, 0},
      {"beside", "T2.nc,...", "more trajectories, as panels beside the first", GBG_TEXT, 0, 0, 0},
      {"columns", "N", "panels in a row (default 3)", GBG_INTEGER, 1, 64, 0},
      {"title", "TEXT", "heading above the picture", GBG_TEXT, 0, 0, 0},
      END}},
    {"plot", "S.nc|T.csv", "draws S(k), or the columns of a table (needs gnuplot)",
     gbg_command_plot,
     {PICTURE, WIDTH,
      {"log", "x|y|xy", "table: logarithmic axes", GBG_CHOICE, 0, 0, 0},
      {"points", "WORD", "table: columns with WORD in their names as points, in the colour of the "
       "column named so without it", GBG_TEXT, 0, 0, 0},
      {"title", "TEXT", "table: above the plot (default: its name)", GBG_TEXT, 0, 0, 0},
      {"ylabel", "TEXT", "table: beside the plot", GBG_TEXT, 0, 0, 0},
      END}},
    {"bench", "[CASE]", "measures speed and error together; without a case, lists the cases",
     gbg_command_bench,
     {BACKEND, THREADS,
      {"n", "N", "particles (default: the sizes of the case)", GBG_INTEGER, 1, 4294967296.0, 0},
      {"json", "F", "file for the figures", GBG_TEXT, 0, 0, 0},
      {"quick", NULL, "small sizes only", GBG_FLAG, 0, 0, 0},
      {"only", "TEXT", "the lines whose names hold this text", GBG_TEXT, 0, 0, 0},
      {"seconds", "S", "no line begins after that time", GBG_REAL, 0, 1e9, 0},
      END}},
    {"info", NULL, "version, components, backend and limits of this build",
     gbg_command_info,
     {END}},
    {.name = NULL},
};
/* clang-format on */
