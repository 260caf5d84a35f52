/* Command: the discs of a picture, cut at the box and repeated where they cross it. */
#include <math.h>
#include <stdlib.h>

#include "command/command.h"
#include "command/picture.h"

struct painter {
    const struct gbg_picture *picture;
    const struct gbg_layout *layout;
    cairo_t *cairo;
    double corner[2], low[2]; /* of the panel */
    double high[2];
};

/* Discs are never drawn smaller than this, so that a million of them are still seen. */
static const double smallest_radius = 0.6;

static double drawn_radius(const struct painter *painter, int64_t i)
{
    double radius = 0.5 * painter->picture->diameter[i] * painter->layout->scale;
    return radius > smallest_radius ? radius : smallest_radius;
}

static void shade(const double colour[3], double towards, double by, double shaded[3])
{
    for (int c = 0; c < 3; c++) {
        shaded[c] = colour[c] + by * (towards - colour[c]);
    }
}

/* 3D: a ball lit from the upper left; far ones (depth 1) fade into the white of the paper. */
static void fill_ball(cairo_t *cairo, double x, double y, double radius, const double colour[3],
                      double depth)
{
    double base[3], light[3], dark[3];
    shade(colour, 1, 0.62 * depth, base);
    shade(base, 1, 0.55, light);
    shade(base, 0, 0.35 * (1 - 0.7 * depth), dark);
    cairo_pattern_t *pattern = cairo_pattern_create_radial(x - 0.35 * radius, y - 0.35 * radius,
                                                           0.05 * radius, x, y, radius);
    cairo_pattern_add_color_stop_rgb(pattern, 0, light[0], light[1], light[2]);
    cairo_pattern_add_color_stop_rgb(pattern, 0.6, base[0], base[1], base[2]);
    cairo_pattern_add_color_stop_rgb(pattern, 1, dark[0], dark[1], dark[2]);
    cairo_set_source(cairo, pattern);
    cairo_fill(cairo);
    cairo_pattern_destroy(pattern);
}

/* 2D: flat, with a rim of a darker shade inside the disc once it is large enough to show. */
static void fill_disc(cairo_t *cairo, double x, double y, double radius, const double colour[3])
{
    double rim = radius > 3 ? fmin(0.14 * radius, 3) : 0, dark[3];
    shade(colour, 0, 0.35, dark);
    cairo_set_source_rgb(cairo, rim > 0 ? dark[0] : colour[0], rim > 0 ? dark[1] : colour[1],
                         rim > 0 ? dark[2] : colour[2]);
    cairo_fill(cairo);
    if (rim > 0) {
        cairo_arc(cairo, x, y, radius - rim, 0, 2 * GBG_PI);
        cairo_set_source_rgb(cairo, colour[0], colour[1], colour[2]);
        cairo_fill(cairo);
    }
}

static double depth_of(const struct gbg_picture *picture, int64_t i)
{
    double fraction = (picture->r[2][i] - picture->origin[2]) / picture->length[2];
    return 1 - (fraction - floor(fraction));
}

static void paint_at(const struct painter *painter, int64_t i, double px, double py)
{
    const struct gbg_picture *picture = painter->picture;
    const double *colour = picture->colour[picture->group[i]];
    double scale = painter->layout->scale, radius = drawn_radius(painter, i);
    double x = painter->corner[0] + (px - painter->low[0]) * scale;
    double y = painter->corner[1] + (painter->high[1] - py) * scale;
    cairo_new_path(painter->cairo);
    cairo_arc(painter->cairo, x, y, radius, 0, 2 * GBG_PI);
    if (picture->dimension == 3) {
        fill_ball(painter->cairo, x, y, radius, colour, depth_of(picture, i));
    } else {
        fill_disc(painter->cairo, x, y, radius, colour);
    }
}

/* First and last image of coordinate r on axis a that reaches into the panel. */
static void image_range(const struct painter *painter, int a, double r, double reach, int *first,
                        int *last)
{
    double length = painter->picture->length[a];
    *first = (int)ceil((painter->low[a] - reach - r) / length);
    *last = (int)floor((painter->high[a] + reach - r) / length);
}

static void paint_particle(const struct painter *painter, int64_t i)
{
    const struct gbg_picture *picture = painter->picture;
    double reach = drawn_radius(painter, i) / painter->layout->scale;
    double x = picture->r[0][i], y = picture->r[1][i];
    if (!isfinite(x) || !isfinite(y) || fabs(x) > 1e6 * picture->length[0] ||
        fabs(y) > 1e6 * picture->length[1]) {
        return;
    }
    int first[2], last[2];
    image_range(painter, 0, x, reach, &first[0], &last[0]);
    image_range(painter, 1, y, reach, &first[1], &last[1]);
    for (int kx = first[0]; kx <= last[0]; kx++) {
        for (int ky = first[1]; ky <= last[1]; ky++) {
            paint_at(painter, i, x + kx * picture->length[0], y + ky * picture->length[1]);
        }
    }
}

struct place {
    double depth;
    int64_t index;
};

static int farther_first(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    return p->depth != q->depth ? (p->depth < q->depth) - (p->depth > q->depth)
                                : (p->index > q->index) - (p->index < q->index);
}

/* The order in which particles are painted: as they come in 2D, the far ones first in 3D. */
static struct place *painting_order(const struct gbg_picture *picture)
{
    struct place *order = malloc(((size_t)picture->n + 1) * sizeof *order);
    if (order) {
        for (int64_t i = 0; i < picture->n; i++) {
            double depth = picture->dimension == 3 ? depth_of(picture, i) : 0;
            order[i] = (struct place){isfinite(depth) ? depth : 1, i};
        }
        if (picture->dimension == 3) {
            qsort(order, (size_t)picture->n, sizeof *order, farther_first);
        }
    }
    return order;
}

int gbg_picture_draw_discs(const struct gbg_picture *picture, const struct gbg_layout *layout,
                           cairo_t *cairo)
{
    struct place *order = painting_order(picture);
    if (!order) {
        return -1;
    }
    for (int p = 0; p < layout->panels; p++) {
        struct painter painter = {.picture = picture, .layout = layout, .cairo = cairo};
        gbg_layout_panel(layout, picture, p, painter.corner, painter.low);
        for (int a = 0; a < 2; a++) {
            painter.high[a] = painter.low[a] + layout->panel[a] / layout->scale;
        }
        cairo_save(cairo);
        cairo_rectangle(cairo, painter.corner[0], painter.corner[1], layout->panel[0],
                        layout->panel[1]);
        cairo_clip(cairo);
        for (int64_t i = 0; i < picture->n; i++) {
            paint_particle(&painter, order[i].index);
        }
        cairo_restore(cairo);
    }
    free(order);
    return 0;
}
