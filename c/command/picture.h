/* Command: the picture of a frame: what is in it, where it goes on the canvas, and its drawing. */
#ifndef GBG_COMMAND_PICTURE_H
#define GBG_COMMAND_PICTURE_H

#include <cairo.h>
#include <stdint.h>

enum { GBG_LEGEND_MOST = 12, GBG_LEGEND_TEXT = 64, GBG_TITLE_TEXT = 512 };

/* What is to be drawn. */
struct gbg_picture {
    int dimension;
    int64_t n;
    double *const *r;       /* coordinates, any image */
    const double *diameter; /* n */
    const int32_t *group;   /* n: colour and legend entry of each particle */
    double length[3], origin[3];
    int groups;
    double colour[GBG_LEGEND_MOST][3];
    char legend[GBG_LEGEND_MOST][GBG_LEGEND_TEXT];
    char title[GBG_TITLE_TEXT];
};

/* Where it goes, in pixels. A box much longer than it is wide is cut along its long axis into
 * `panels` pieces, drawn one under (or beside) the other. */
struct gbg_layout {
    double width, height;
    double font;
    double scale;     /* pixels a unit of length */
    double left, top; /* corner of the first panel */
    double panel[2];  /* size of a panel */
    double gap;       /* between panels */
    int cut_axis, panels;
    double legend_top; /* of the first row */
    int legend_row[GBG_LEGEND_MOST];
    double legend_left[GBG_LEGEND_MOST];
    int legend_rows;
    double bar; /* length of the scale bar, in units of length */
};

void gbg_picture_lay_out(const struct gbg_picture *picture, double width,
                         struct gbg_layout *layout);
/* One line of text in the middle of the top of a canvas. */
void gbg_picture_heading(const char *text, double width, double font, cairo_t *cairo);
/* On a canvas that is white already. 0, or -1 without memory. */
int gbg_picture_draw(const struct gbg_picture *picture, const struct gbg_layout *layout,
                     cairo_t *cairo);
/* The discs alone, all panels. 0, or -1 without memory. */
int gbg_picture_draw_discs(const struct gbg_picture *picture, const struct gbg_layout *layout,
                           cairo_t *cairo);
/* Corner of panel p on the canvas, and of the piece of the box that it shows. */
void gbg_layout_panel(const struct gbg_layout *layout, const struct gbg_picture *picture, int p,
                      double corner[2], double low[2]);

#endif
