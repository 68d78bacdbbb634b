// What the readers of lights share.
#pragma once

#include <string_view>

#include "engine/pbrt/state.h"

namespace lucerna {

// A colour of a light, by read_spectrum; white if it is not given. "scale", a float or version 3's colour,
// is not yet applied.
Rgb light_color(Reading& reading, Params& params, std::string_view name, ColorUse use = ColorUse::emission);
// "scale" applied to `value`.
Rgb scaled_color(Reading& reading, Params& params, const Rgb& value);
// A positive number where the parameter is given, otherwise 0.
double positive_or_none(Params& params, std::string_view name);
// How strong a light is: `color` with "scale" applied, and "power" times the luminance of "scale" (0 where it
// is not given), since in pbrt-v4 "scale" multiplies whatever "power" has set.
struct Strength {
    Rgb color;
    double power;
};
Strength read_strength(Reading& reading, Params& params, const Rgb& color);
// `color` such that the luminance of what it makes is "illuminance", where that is given; `illuminance_now`
// is what `color` makes.
Rgb with_illuminance(Params& params, const Rgb& color, double illuminance_now);

// "lightgroup", the name of the group that the light is in, our own parameter: letters, digits, "_" and "-",
// as names of layers may have in any program. Empty if it is not given.
std::string read_light_group(Params& params);

// Lights with an image.
bool names_an_image(Params& params);
Rgb mean_of_image(Reading& reading, Params& params);
void read_image_infinite(Reading& reading, Params& params);
void read_goniometric(Reading& reading, Params& params);
void read_projection(Reading& reading, Params& params);

// Lights from photometric files: "ies" and "ldt".
void read_photometric_light(Reading& reading, const std::string& kind, Params& params);

// The current transformation's axes; it may rotate, mirror and scale alike in all directions. Others are
// straightened, starting with z.
LightAxes light_axes(const Reading& reading, const Params& params);
// Lamps measured.
void read_light_field(Reading& reading, Params& params);
void read_ray_file(Reading& reading, Params& params);

}  // namespace lucerna
