// Lamps from photometric files: LightSource "ies" and "ldt", far-field lights at a point, in lumens.
//
// The lamp's frame is that of the light fields: nadir (γ = 0) is +z, the plane C0 holds +x, C90 holds -y; the
// current transformation places it. So a lamp that hangs is turned until its z points down, as pbrt's spot
// is.
#include "engine/pbrt/light_params.h"
#include "lights/ies.h"
#include "lights/ldt.h"

namespace lucerna {
namespace {

// Warnings of a file's reader, with the place in the scene that asks for the file.
class PlacedMonitor final : public Monitor {
  public:
    PlacedMonitor(Reading& reading, const Place& place) : reading_(reading), place_(place) {}
    void warn(std::string_view line) override { reading_.warn(place_, printable(std::string(line))); }

  private:
    Reading& reading_;
    const Place& place_;
};

}  // namespace

void read_photometric_light(Reading& reading, const std::string& kind, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::filesystem::path file = reading.resolve(params.string("filename", ""));
    const Place& place = params.place_of("filename");
    PhotometricSpec spec;
    spec.kind = kind == "ies" ? "ies" : "ldt";
    try {
        PlacedMonitor monitor(reading, place);
        spec.web = std::make_shared<const PhotometricWeb>(kind == "ies" ? read_ies(file, monitor)
                                                                        : read_ldt(file, monitor));
    } catch (const InputError& error) {
        fail(place, "{}", printable(error.what()));
    }
    spec.axes = light_axes(reading, params);
    spec.position = transform_point(reading.state.ctm, params.point("from", V3d(0)));
    // A colour tints the light and leaves its candela as they are.
    const Rgb colour = light_color(reading, params, "color");
    if (!(luminance(colour) > 0)) fail(params.place_of("color"), "\"color\" is black");
    spec.scale = scaled_color(reading, params, colour / luminance(colour));
    reading.draft.lights.push_back({params.place(), spec, positive_or_none(params, "power")});
}

}  // namespace lucerna
