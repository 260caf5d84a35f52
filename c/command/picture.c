/* Command: the picture of a frame: layout, frame, title, legend and scale bar. */
#include "command/picture.h"
#include "command/command.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double text_colour = 0.15;

/* Boxes longer than this many times their width are cut into pieces. */
static const double longest_aspect = 8;
/* A picture is at most this many times as high as it is wide. */
static const double highest = 1.5;

static void use_font(cairo_t *cairo, double size)
{
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, size);
    cairo_set_source_rgb(cairo, text_colour, text_colour, text_colour);
}

static double text_width(cairo_t *cairo, const char *text)
{
    cairo_text_extents_t extents;
    cairo_text_extents(cairo, text, &extents);
    return extents.x_advance;
}

/* Largest of 1, 2, 5 times a power of ten that is not above x. */
static double round_length(double x)
{
    double power = pow(10, floor(log10(x) + 1e-9));
    double digit = x / power;
    return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

/* Puts the legend's entries into rows, leaving the right third of the first row to the scale bar.
 */
static void lay_out_legend(const struct gbg_picture *picture, struct gbg_layout *layout)
{
    cairo_surface_t *scratch = cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1);
    cairo_t *cairo = cairo_create(scratch);
    use_font(cairo, layout->font);
    double left = layout->left, right = layout->left + 0.66 * (layout->width - 2 * layout->left);
    double at = left;
    int row = 0;
    for (int g = 0; g < picture->groups; g++) {
        double size = text_width(cairo, picture->legend[g]) + 3.2 * layout->font;
        if (at > left && at + size > right) {
            at = left;
            row++;
        }
        layout->legend_row[g] = row;
        layout->legend_left[g] = at;
        at += size;
    }
    layout->legend_rows = row + 1;
    cairo_destroy(cairo);
    cairo_surface_destroy(scratch);
}

static void cut_into_panels(const struct gbg_picture *picture, struct gbg_layout *layout)
{
    const double *length = picture->length;
    layout->cut_axis = length[1] > length[0];
    double aspect = length[layout->cut_axis] / length[!layout->cut_axis];
    layout->panels = aspect > longest_aspect ? (int)ceil(sqrt(aspect)) : 1;
    layout->panels = layout->panels > 64 ? 64 : layout->panels;
}

void gbg_picture_lay_out(const struct gbg_picture *picture, double width, struct gbg_layout *layout)
{
    memset(layout, 0, sizeof *layout);
    layout->width = width;
    layout->font = fmin(fmax(width / 58, fmax(9, fmin(width / 40, 16))), 60);
    layout->gap = layout->font * 0.6;
    double margin = 1.6 * layout->font, room = width - 2 * margin;
    cut_into_panels(picture, layout);
    int m = layout->panels, across = layout->cut_axis == 1;
    double gaps = (m - 1) * layout->gap;
    double size[2] = {picture->length[0], picture->length[1]};
    size[layout->cut_axis] /= m;
    double columns = across ? m : 1, rows = across ? 1 : m;
    double by_width = (room - (across ? gaps : 0)) / (columns * size[0]);
    double by_height = (highest * room - (across ? 0 : gaps)) / (rows * size[1]);
    layout->scale = fmin(by_width, fmax(by_height, 1 / size[1]));
    for (int a = 0; a < 2; a++) {
        layout->panel[a] = layout->scale * size[a];
    }
    double used = columns * layout->panel[0] + (across ? gaps : 0);
    layout->left = margin;
    layout->top = 3.1 * layout->font;
    lay_out_legend(picture, layout);
    layout->left += (room - used) / 2;
    double bottom = layout->top + rows * layout->panel[1] + (across ? 0 : gaps);
    layout->legend_top = bottom + 1.1 * layout->font;
    layout->height =
        ceil(layout->legend_top + 1.7 * layout->font * layout->legend_rows + 0.9 * layout->font);
    layout->bar = round_length(fmin(0.2 * room, 0.8 * used) / layout->scale);
}

void gbg_layout_panel(const struct gbg_layout *layout, const struct gbg_picture *picture, int p,
                      double corner[2], double low[2])
{
    corner[0] = layout->left;
    corner[1] = layout->top;
    low[0] = picture->origin[0];
    low[1] = picture->origin[1];
    /* Pieces of a wide box go one under the other, pieces of a high box side by side. */
    int stack = !layout->cut_axis;
    corner[stack] += p * (layout->panel[stack] + layout->gap);
    low[layout->cut_axis] += p * picture->length[layout->cut_axis] / layout->panels;
}

static void draw_title(const struct gbg_picture *picture, const struct gbg_layout *layout,
                       cairo_t *cairo)
{
    double margin = 1.6 * layout->font, size = layout->font;
    use_font(cairo, size);
    double wide = text_width(cairo, picture->title), room = layout->width - 2 * margin;
    if (wide > room) {
        size *= room / wide;
        use_font(cairo, size);
    }
    cairo_move_to(cairo, margin, 2.0 * layout->font);
    cairo_show_text(cairo, picture->title);
}

static void draw_legend(const struct gbg_picture *picture, const struct gbg_layout *layout,
                        cairo_t *cairo)
{
    double font = layout->font, radius = 0.5 * font;
    for (int g = 0; g < picture->groups; g++) {
        double x = layout->legend_left[g];
        double y = layout->legend_top + (1.7 * layout->legend_row[g] + 0.5) * font;
        const double *c = picture->colour[g];
        cairo_new_path(cairo);
        cairo_arc(cairo, x + radius, y, radius, 0, 2 * GBG_PI);
        cairo_set_source_rgb(cairo, c[0], c[1], c[2]);
        cairo_fill(cairo);
        use_font(cairo, font);
        cairo_move_to(cairo, x + 1.4 * font, y + 0.35 * font);
        cairo_show_text(cairo, picture->legend[g]);
    }
}

static void draw_scale_bar(const struct gbg_layout *layout, cairo_t *cairo)
{
    char text[64];
    double font = layout->font, right = layout->width - 1.6 * font;
    double size = layout->bar * layout->scale, y = layout->legend_top + 0.5 * font;
    snprintf(text, sizeof text, "%g \317\203", layout->bar);
    use_font(cairo, font);
    double wide = text_width(cairo, text);
    cairo_move_to(cairo, right - size - 0.7 * font - wide, y + 0.35 * font);
    cairo_show_text(cairo, text);
    cairo_set_line_width(cairo, fmax(1.5, 0.14 * font));
    cairo_set_line_cap(cairo, CAIRO_LINE_CAP_BUTT);
    cairo_move_to(cairo, right - size, y);
    cairo_line_to(cairo, right, y);
    for (int end = 0; end < 2; end++) {
        cairo_move_to(cairo, right - end * size, y - 0.3 * font);
        cairo_line_to(cairo, right - end * size, y + 0.3 * font);
    }
    cairo_stroke(cairo);
}

static void draw_frames(const struct gbg_picture *picture, const struct gbg_layout *layout,
                        cairo_t *cairo)
{
    cairo_set_source_rgb(cairo, 0.35, 0.35, 0.35);
    cairo_set_line_width(cairo, fmax(1, layout->font / 18));
    for (int p = 0; p < layout->panels; p++) {
        double corner[2], low[2];
        gbg_layout_panel(layout, picture, p, corner, low);
        cairo_rectangle(cairo, corner[0], corner[1], layout->panel[0], layout->panel[1]);
        cairo_stroke(cairo);
    }
}

void gbg_picture_heading(const char *text, double width, double font, cairo_t *cairo)
{
    use_font(cairo, font);
    cairo_move_to(cairo, fmax(0, 0.5 * (width - text_width(cairo, text))), 1.7 * font);
    cairo_show_text(cairo, text);
}

int gbg_picture_draw(const struct gbg_picture *picture, const struct gbg_layout *layout,
                     cairo_t *cairo)
{
    int status = gbg_picture_draw_discs(picture, layout, cairo);
    draw_frames(picture, layout, cairo);
    draw_title(picture, layout, cairo);
    draw_legend(picture, layout, cairo);
    draw_scale_bar(layout, cairo);
    return status;
}
