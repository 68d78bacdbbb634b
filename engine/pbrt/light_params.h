// Functions that the readers of lights share.
#pragma once

#include <string_view>

#include "engine/pbrt/state.h"

namespace lucerna {

// Reads the colour of a light by read_spectrum; white if it is not given. Does not apply "scale", a float or,
// in version 3, a colour.
Rgb light_color(Reading& reading, Params& params, std::string_view name, ColorUse use = ColorUse::emission);
// Returns `value` times "scale".
Rgb scaled_color(Reading& reading, Params& params, const Rgb& value);
// Reads a positive number, or returns 0 if the parameter is not given.
double positive_or_none(Params& params, std::string_view name);
// The strength of a light: `color` times "scale", and "power" times the luminance of "scale" (0 if not
// given), as in pbrt-v4 "scale" also multiplies "power".
struct Strength {
    Rgb color;
    double power;
};
Strength read_strength(Reading& reading, Params& params, const Rgb& color);
// Scales `color` so that it gives the luminance "illuminance", if that is given. `illuminance_now` is what
// `color` gives.
Rgb with_illuminance(Params& params, const Rgb& color, double illuminance_now);

// Reads "lightgroup", the name of the light's group, a parameter of Lucerna. It allows letters, digits, "_"
// and "-", which every program accepts in layer names. Empty if not given.
std::string read_light_group(Params& params);

// Normalises also vectors whose square overflows a double; returns 0 for 0.
V3d unit(const V3d& v);
// Reads a direction in the current coordinates as a unit vector; none if it is not given.
std::optional<V3d> read_direction(Params& params, std::string_view name);

// Readers of lights with an image.
bool names_an_image(Params& params);
Rgb mean_of_image(Reading& reading, Params& params);
void read_image_infinite(Reading& reading, Params& params);
void read_goniometric(Reading& reading, Params& params);
void read_projection(Reading& reading, Params& params);

// Reads a sky and its sun.
void read_sky(Reading& reading, Params& params);

// Reads lights from photometric files: "photometric", "ies" and "ldt".
void read_photometric_light(Reading& reading, const std::string& kind, Params& params);

// Reads "from", "to" and "up" of a lamp that shines along its +z, and returns the transformation from its
// frame to the world. It moves the origin to "from" (default: the origin), then the current transformation
// applies. With "to" it first turns +z towards "to" and +y as near to "up" (default: +y) as possible, as
// LookAt does. Along "up" it is +x that stays as near to +x as possible, or to +y if "up" is closest to the x
// axis. Throws TextError if "from" and "to" are the same point or "up" is no direction.
M44d read_placement(const Reading& reading, Params& params);
// Returns the axes of a transformation to the world, which may rotate, mirror and scale uniformly. Other
// transformations are orthogonalised, starting with z.
LightAxes light_axes(const M44d& world_from_light, const Params& params);
// Readers of measured lamps.
void read_light_field(Reading& reading, Params& params);
void read_ray_file(Reading& reading, Params& params);

}  // namespace lucerna
