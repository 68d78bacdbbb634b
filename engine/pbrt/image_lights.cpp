// Lights with an image: infinite, goniometric, projection. The parameter's name tells the version. "mapname"
// belongs to versions 1 to 3, with images by latitude and longitude; "filename" belongs to version 4, with
// square equal-area images. As users have such images, a "filename" twice as wide as high is read by latitude
// and longitude.
#include <cmath>

#include "engine/pbrt/light_params.h"

namespace lucerna {
namespace {

struct NamedImage {
    std::shared_ptr<const Image> image;
    bool version4;
};

// Reads the image; version 3 allows goniometric lights without one.
NamedImage read_image(Reading& reading, Params& params) {
    const bool version4 = params.has("filename");
    const std::string_view parameter = version4 ? "filename" : "mapname";
    const std::string name = params.string(parameter, "");
    const auto grey = [version4](float value) {
        auto image = std::make_shared<Image>(Image::rgb(1, 1));
        image->set_rgb(0, 0, Rgb(value));
        return NamedImage{std::move(image), version4};
    };
    if (name.empty()) return grey(1);
    const std::filesystem::path file = reading.resolve(name);
    std::error_code status;
    if (reading.skip_missing && !std::filesystem::exists(file, status)) {
        reading.warn(params.place_of(parameter),
                     fmt::format("{}: the file is missing; grey is used", printable(file.string())));
        return grey(0.5F);
    }
    try {
        const auto warn = [&](const std::string& text) {
            reading.warn(params.place_of(parameter), printable(text));
        };
        return {read_texture_image(file, reading.colours(), warn), version4};
    } catch (const InputError& error) {
        fail_always(params.place_of(parameter), "{}", printable(error.what()));
    }
}

std::shared_ptr<const DirectionalImage> read_sphere(Reading& reading, Params& params) {
    const NamedImage named = read_image(reading, params);
    const int width = named.image->width, height = named.image->height;
    SphereMap map = SphereMap::latitude_longitude;
    if (named.version4) {
        if (width == height) {
            map = SphereMap::equal_area;
        } else if (width == 2 * height) {
            reading.warn(params.place_of("filename"),
                         fmt::format("{} × {} is not square: read as latitude-longitude", width, height));
        } else {
            params.warn_or_refuse(
                params.place_of("filename"),
                fmt::format("the image is {} × {}; expected a square image (equal-area), or one "
                            "twice as wide as high (latitude-longitude)",
                            width, height),
                "it is read as latitude-longitude");
        }
    }
    return std::make_shared<DirectionalImage>(named.image, map);
}

V3d read_position(Reading& reading, Params& params) {
    return transform_point(reading.state.ctm, params.point("from", V3d(0)));
}

}  // namespace

LightAxes light_axes(const M44d& m, const Params& params) {
    const auto axis = [&m](int i) { return V3d(m[i][0], m[i][1], m[i][2]).normalized(); };
    const V3d x = axis(0), y = axis(1), z = axis(2);
    if (uniform_scale(m)) return {V3f(x), V3f(y), V3f(z)};
    const V3d across = (x - x.dot(z) * z).normalized();
    const V3d rest = z.cross(across);
    constexpr std::string_view what =
        "is stretched or sheared by its transformation; expected rotation, reflection, translation and "
        "uniform scale";
    if (!(rest.length2() > 0.5)) fail(params.place(), "{} {}", params.owner(), what);
    params.warn_or_refuse(params.place(), fmt::format("{} {}", params.owner(), what),
                          "its frame is straightened");
    return {V3f(across), V3f(rest.dot(y) < 0 ? -rest : rest), V3f(z)};
}

Rgb mean_of_image(Reading& reading, Params& params) {
    const auto image = read_image(reading, params).image;
    V3d sum(0);
    for (int y = 0; y < image->height; ++y) {
        for (int x = 0; x < image->width; ++x) sum += V3d(image->rgb_at(x, y));
    }
    return Rgb(sum / (static_cast<double>(image->width) * image->height));
}

bool names_an_image(Params& params) {
    return params.has("filename") || params.has("mapname");
}

void read_image_infinite(Reading& reading, Params& params) {
    const auto image = read_sphere(reading, params);
    // The image is in the scene's unit, and "L" is a factor.
    const Rgb factor = light_color(reading, params, "L", ColorUse::tint);
    const double illuminance =
        double{image->irradiance().dot(reading.colours().weights())} * double{luminance(factor)};
    const Rgb color = with_illuminance(params, factor, illuminance);
    reading.draft.lights.push_back(
        {params.place(), ImageInfiniteSpec{image, light_axes(reading.state.ctm, params),
                                           scaled_color(reading, params, color)}});
}

void read_goniometric(Reading& reading, Params& params) {
    const auto image = read_sphere(reading, params);
    LightAxes axes = light_axes(reading.state.ctm, params);
    std::swap(axes.y, axes.z);  // the image's pole is the light's +y in every version
    const auto [intensity, power] = read_strength(reading, params, light_color(reading, params, "I"));
    reading.draft.lights.push_back(
        {params.place(), GoniometricSpec{read_position(reading, params), axes, image, intensity}, power});
}

void read_projection(Reading& reading, Params& params) {
    if (!names_an_image(params)) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const NamedImage named = read_image(reading, params);
    const double fov = params.real_within("fov", named.version4 ? 90 : 45, 0.01, 179.9);
    // Version 4 projects the image upright, earlier versions upside down.
    const auto slide = std::make_shared<const Slide>(named.image, fov, named.version4);
    const auto [intensity, power] = read_strength(reading, params, light_color(reading, params, "I"));
    reading.draft.lights.push_back({params.place(),
                                    ProjectionSpec{read_position(reading, params),
                                                   light_axes(reading.state.ctm, params), slide, intensity},
                                    power});
}

}  // namespace lucerna
