#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"
#include "lights/xml_values.h"

namespace lucerna {
namespace {

constexpr double kMostMetres = 12;  // No luminaire is longer: larger numbers are millimetres.

// Returns a name without spaces and underscores, which files write in several ways: "Symm _ Bi _ 0".
std::string folded(std::string_view text) {
    std::string name;
    for (const char c : lower_case(text)) {
        if (c != ' ' && c != '_') name += c;
    }
    return name;
}

// Reads the luminous data of one file.
class Tm33 {
  public:
    Tm33(const XmlElement& root, std::string file, Monitor& monitor)
        : root_(root), file_(std::move(file)), monitor_(monitor) {}

    std::vector<LuminaireEmitter> emitters();

  private:
    Location at(const XmlElement& element) const { return {file_, element.line, 1}; }
    template <typename... Args>
    void warn(const XmlElement& element, fmt::format_string<Args...> text, Args&&... args) {
        monitor_.warn(to_string(at(element)) + ": " + fmt::format(text, std::forward<Args>(args)...));
    }
    // Returns the element that holds the luminous intensities of the emitter, or null if it has none.
    static const XmlElement* intensities_of(const XmlElement& emitter);
    [[noreturn]] void refuse_without_intensities(const XmlElement& emitter) const;
    LuminaireEmitter read(const XmlElement& emitter, const XmlElement& data);
    void require_type_c(const XmlElement& data) const;
    PhotometricGrid read_table(const XmlElement& data, double factor) const;
    void require_count(const XmlElement& data, std::string_view name, std::size_t found) const;
    void complete(PhotometricGrid& grid, const XmlElement& data);
    void compare_flux(const XmlElement& emitter, const XmlElement& data, double flux);
    double metres_per_unit();
    // Returns the element with the luminaire's sizes, or null.
    const XmlElement* dimensions() const;
    LuminousOpening opening_of(const XmlElement& emitter);
    // Returns the extent of all areas along the axis of "Width" or "Length", in the file's unit.
    double extent_of(const std::vector<const XmlElement*>& areas, const std::string& name) const;
    V3d position_of(const XmlElement& emitter);

    const XmlElement& root_;
    std::string file_;
    Monitor& monitor_;
    double unit_ = 0;  // metres; 0: not yet known
};

std::vector<LuminaireEmitter> Tm33::emitters() {
    const std::vector<const XmlElement*> all = root_.all("Emitter");
    if (all.empty()) input_error(at(root_), "<{}> has no <Emitter>", shown_value(root_.name));
    std::vector<LuminaireEmitter> found;
    for (const XmlElement* emitter : all) {
        if (const XmlElement* data = intensities_of(*emitter)) {
            found.push_back(read(*emitter, *data));
        } else {
            if (all.size() == 1) refuse_without_intensities(*emitter);
            warn(*emitter, "the emitter has no luminous intensities and is left out");
        }
        for (const char* spectral : {"SpectralData", "SpectralDistribution", "AngularColor"}) {
            if (!emitter->child(spectral)) continue;
            warn(*emitter, "<{}> is not read: the light is white, unless the scene tints it", spectral);
            break;
        }
    }
    if (found.empty()) refuse_without_intensities(*all.front());
    // A single emitter's opening is at the place of the lamp.
    if (found.size() == 1) found.front().position = V3d(0, 0, 0);
    return found;
}

const XmlElement* Tm33::intensities_of(const XmlElement& emitter) {
    if (const XmlElement* data = emitter.child("LuminousData")) {
        const XmlElement* intensity = data->child("LuminousIntensity");
        return intensity ? intensity : data;
    }
    for (const XmlElement* data : emitter.all("IntensityDistribution")) {
        const std::string metric = folded(data->text_of("Metric"));
        if (metric.empty() || metric == "luminous") return data;
    }
    return nullptr;
}

void Tm33::refuse_without_intensities(const XmlElement& emitter) const {
    std::string others;
    for (const char* name : {"RadiantData", "PhotonData", "SpectralData", "IllumData", "IrradData"}) {
        if (emitter.child(name)) others += (others.empty() ? "; it has " : ", ") + std::string(name);
    }
    input_error(at(emitter), "the emitter has no luminous intensities, expected in <LuminousData>{}", others);
}

LuminaireEmitter Tm33::read(const XmlElement& emitter, const XmlElement& data) {
    require_type_c(data);
    const double multiplier = xml_child(data, "Multiplier", file_, 0, 1e9, 1);
    const double ballast = xml_child(emitter, "BallastFactor", file_, 0, 1e3, 1);
    if (ballast != 1) warn(emitter, "the ballast factor {:g} is not applied to the candela", ballast);
    PhotometricGrid grid = read_table(data, multiplier);
    complete(grid, data);
    if (const std::string why = grid.fault(); !why.empty()) throw InputError(at(data), why);

    PhotometricInfo info;
    std::string provenance = root_.name;
    if (const XmlElement* header = root_.child("Header")) {
        for (const XmlElement& entry : header->children) info.keywords.emplace_back(entry.name, entry.text);
        for (const char* key : {"Manufacturer", "CatalogNumber", "Description"}) {
            if (const std::string_view text = header->text_of(key); !text.empty())
                provenance += fmt::format(", {}", text);
        }
    }
    info.provenance = one_line(plain_text(provenance));
    const double rated = xml_child(emitter, "RatedLumens", file_, 0, 1e12, 0);
    const std::string absolute = folded(data.text_of("AbsolutePhotometry"));
    if (absolute == "false" || absolute == "0") info.lamp_lumens = rated;
    info.watts = std::max(xml_child(emitter, "InputWattage", file_, 0, 1e9, 0),
                          xml_child(emitter, "InputWatts", file_, 0, 1e9, 0));
    info.opening = opening_of(emitter);
    info.axis_along_c90 = true;
    LuminaireEmitter found{PhotometricWeb(std::move(grid), std::move(info)), position_of(emitter)};
    compare_flux(emitter, data, found.web.flux());
    return found;
}

void Tm33::require_type_c(const XmlElement& data) const {
    const XmlElement* type = data.child("PhotometryType");
    if (const XmlElement* equipment = root_.child("Equipment"); !type && equipment) {
        for (const char* name : {"Gonioradiometer", "Goniometer"}) {
            const XmlElement* instrument = equipment->child(name);
            if (instrument && !type) type = instrument->child("Type");
            if (instrument && !type) type = instrument->child("GoniometerType");
        }
    }
    if (!type || type->text.empty()) return;
    const std::string name = folded(type->text);
    if (name == "c" || name == "typec" || name == "ciec" || name == "iesc") return;
    input_error(at(*type), "the goniometer's type is \"{}\"; expected C planes (CIE_C or IES_C)",
                shown_value(type->text));
}

// Reads intensities that name their angles, in any order.
PhotometricGrid Tm33::read_table(const XmlElement& data, double factor) const {
    std::map<double, std::map<double, float>> planes;
    for (const XmlElement& point : data.children) {
        if (point.name != "IntData" && point.name != "IntensityData") continue;
        const auto angle = [&](std::initializer_list<const char*> names, double least, double most) {
            for (const char* name : names) {
                if (point.attribute(name)) return xml_attribute(point, name, file_, least, most);
            }
            return xml_attribute(point, *names.begin(), file_, least, most);
        };
        const double h = angle({"h", "horz", "horizontal"}, -360, 360);
        const double v = angle({"v", "vert", "vertical"}, 0, 180);
        const double candela = factor * xml_number(point.text, point, file_, "an intensity", 0, 1e30);
        if (!(candela <= 1e30))
            input_error(at(point), "an intensity is {:g} cd; expected 0 to 1e30", candela);
        if (!planes[h].emplace(v, static_cast<float>(candela)).second)
            input_error(at(point), "a second intensity at h {:g}, v {:g}", h, v);
    }
    if (planes.empty()) input_error(at(data), "<{}> has no <IntData>", data.name);
    PhotometricGrid grid{PhotometricPlanes::c, {}, {}, {}};
    for (const auto& [v, candela] : planes.begin()->second) grid.polar.push_back(v);
    for (const auto& [h, plane] : planes) {
        grid.azimuth.push_back(h);
        std::size_t i = 0;
        for (const auto& [v, candela] : plane) {
            if (plane.size() != grid.polar.size() || v != grid.polar[i++]) {
                input_error(at(data),
                            "the plane h {:g} has {} intensities, at other angles v than the {} of the plane "
                            "h {:g}; expected the angles of the first plane",
                            h, plane.size(), grid.polar.size(), planes.begin()->first);
            }
            grid.candela.push_back(candela);
        }
    }
    require_count(data, "NumberHorz", grid.azimuth.size());
    require_count(data, "NumberVert", grid.polar.size());
    require_count(data, "NumberMeasured", grid.candela.size());
    return grid;
}

void Tm33::require_count(const XmlElement& data, std::string_view name, std::size_t found) const {
    const double stated = xml_child(data, name, file_, 0, 1e9, static_cast<double>(found));
    if (stated == static_cast<double>(found)) return;
    input_error(at(*data.child(name)), "{} is {:g}, but the intensities have {}", name, stated, found);
}

// Completes the planes by the stated symmetry, or by their angles if none is stated.
void Tm33::complete(PhotometricGrid& grid, const XmlElement& data) {
    const XmlElement* stated = data.child("Symm") ? data.child("Symm") : data.child("SymmType");
    const std::string symmetry = stated ? folded(stated->text) : std::string();
    constexpr std::array kBoth{0.0, 90.0};
    const std::span<const double> both(kBoth);
    const double first = grid.azimuth.front(), last = grid.azimuth.back();
    const auto refuse = [&](std::string_view expected) {
        input_error(at(*stated), "{} with planes from {:g} to {:g} degrees; expected {}",
                    shown_value(stated->text), first, last, expected);
    };
    if (grid.azimuth.size() == 1 && symmetry != "symmfull" && !symmetry.empty())
        warn(*stated, "{} with one plane, which is used all around", shown_value(stated->text));
    if (grid.azimuth.size() == 1 || symmetry.empty()) return complete_ies_planes(grid, at(data));
    if (symmetry == "symmfull") refuse("one plane");
    if (symmetry == "symmnone" || symmetry == "symmarbitrary") {
        if (!(last - first > 180)) refuse("planes all around");
        return complete_ies_planes(grid, at(data));
    }
    if (symmetry == "symmquad") {
        if (first > 0 || last < 90) refuse("planes from 0 to 90");
        return complete_c_planes(grid, both);
    }
    if (symmetry == "symmbi0") {
        if (first > 0 || last < 180) refuse("planes from 0 to 180");
        return complete_c_planes(grid, both.first(1));
    }
    if (symmetry == "symmbi90") {
        if (!(first <= 90 && last >= 270) && !(first <= -90 && last >= 90)) refuse("planes from 90 to 270");
        return complete_c_planes(grid, both.last(1));
    }
    input_error(at(*stated),
                "the symmetry is \"{}\"; expected Symm_None, Symm_Bi_0, Symm_Bi_90, Symm_Quad, Symm_Full or "
                "Symm_Arbitrary",
                shown_value(stated->text));
}

// Some programs write candela per 1000 lm, or numbers that do not belong together.
void Tm33::compare_flux(const XmlElement& emitter, const XmlElement& data, double flux) {
    double stated = xml_child(data, "LuminousFlux", file_, 0, 1e12, 0);
    if (const XmlElement* luminous = emitter.child("LuminousData"); luminous && !(stated > 0))
        stated = xml_child(*luminous, "LuminousFlux", file_, 0, 1e12, 0);
    const double rated = xml_child(emitter, "RatedLumens", file_, 0, 1e12, 0);
    if (stated > 0 && std::fabs(flux - stated) > 0.05 * stated)
        warn(emitter, "the intensities add up to {:.4g} lm, but LuminousFlux is {:g}", flux, stated);
    else if (!(stated > 0) && rated > 0 && (flux > 1.05 * rated || flux < 0.3 * rated))
        warn(emitter,
             "the intensities add up to {:.4g} lm, but RatedLumens is {:g}; they are read as candela, not as "
             "candela per 1000 lm",
             flux, rated);
}

const XmlElement* Tm33::dimensions() const {
    const XmlElement* luminaire = root_.child("Luminaire");
    return luminaire ? luminaire->child("Dimensions") : nullptr;
}

// Lengths are metres; files exist that state them in millimetres, which their size shows.
double Tm33::metres_per_unit() {
    if (unit_ > 0) return unit_;
    unit_ = 1;
    const XmlElement* sizes = dimensions();
    if (!sizes) return unit_;
    double largest = 0;
    for (const char* name : {"Length", "Width", "Height"})
        largest = std::max(largest, xml_child(*sizes, name, file_, 0, 1e6, 0));
    if (!(largest > kMostMetres)) return unit_;
    warn(*sizes, "a dimension of {:g} m is read as millimetres, and so are all lengths", largest);
    return unit_ = 1e-3;
}

// Returns the number of the side, C0, C90, C180 or C270, that this face of an emitter looks to; none for one
// that looks up or down.
std::optional<std::size_t> side_of(const XmlElement& face) {
    constexpr std::string_view kSides[] = {"C0Face", "C90Face", "C180Face", "C270Face"};
    const auto* const side = std::find(std::begin(kSides), std::end(kSides), face.name);
    if (side == std::end(kSides)) return std::nullopt;
    return static_cast<std::size_t>(side - std::begin(kSides));
}

bool is_disc(const XmlElement& area) {
    const std::string circular = folded(area.text_of("Circular"));
    return circular == "true" || circular == "1";
}

// Length lies along C90-C270 and Width along C0-C180, as the faces of an emitter show: those towards C0 have
// a Length, those towards C90 a Width.
LuminousOpening Tm33::opening_of(const XmlElement& emitter) {
    using Shape = LuminousOpening::Shape;
    const double unit = metres_per_unit();
    std::array<double, 4> heights{};
    std::vector<const XmlElement*> areas;  // that look up or down
    if (const XmlElement* faces = emitter.child("EmissionAreas")) {
        for (const XmlElement& face : faces->children) {
            const auto side = side_of(face);
            for (const XmlElement& area : face.children) {
                if (!area.name.ends_with("Area")) continue;
                if (side) {
                    const double height = unit * xml_child(area, "Height", file_, 0, 1e6, 0);
                    heights[*side] = std::max(heights[*side], height);
                } else {
                    areas.push_back(&area);
                }
            }
        }
        if (areas.size() > 1)
            warn(*faces, "the luminous opening is the rectangle around {} areas", areas.size());
    }
    if (!areas.empty()) {
        const Shape shape =
            areas.size() == 1 && is_disc(*areas.front()) ? Shape::cylinder_upright : Shape::box;
        return {shape, unit * extent_of(areas, "Width"), unit * extent_of(areas, "Length"), heights};
    }
    const XmlElement* sizes = dimensions();
    if (!sizes) return {};
    const bool upright = folded(root_.child("Luminaire")->text_of("Shape")) == "alignz";
    return {upright ? Shape::cylinder_upright : Shape::box,
            unit * xml_child(*sizes, "Width", file_, 0, 1e6, 0),
            unit * xml_child(*sizes, "Length", file_, 0, 1e6, 0), heights};
}

double Tm33::extent_of(const std::vector<const XmlElement*>& areas, const std::string& name) const {
    double low = 1e30, high = -1e30;
    for (const XmlElement* area : areas) {
        const double half = 0.5 * xml_child(*area, name, file_, 0, 1e6, 0);
        const double middle = xml_child(*area, name + "Offset", file_, -1e6, 1e6, 0);
        low = std::min(low, middle - half);
        high = std::max(high, middle + half);
    }
    return high - low;
}

V3d Tm33::position_of(const XmlElement& emitter) {
    const XmlElement* centre = emitter.child("EmitterCenter");
    if (!centre) return {0, 0, 0};
    const auto offset = [&](const char* name) {
        return metres_per_unit() * xml_child(*centre, name, file_, -1e6, 1e6, 0);
    };
    return {offset("WidthOffset"), -offset("LengthOffset"), -offset("HeightOffset")};
}

}  // namespace

bool is_tm33_root(std::string_view name) {
    return name.starts_with("IESTM33") || name == "LuminaireOpticalData";
}

std::vector<LuminaireEmitter> parse_tm33(std::string_view text, const std::string& file, Monitor& monitor) {
    const XmlElement root = parse_xml(text, file);
    if (!is_tm33_root(root.name)) {
        input_error({file, root.line, 1}, "the root is <{}>; expected <IESTM33-18>, <IESTM33-22> or alike",
                    shown_value(root.name));
    }
    return Tm33(root, file, monitor).emitters();
}

}  // namespace lucerna
