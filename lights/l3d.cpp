#include "lights/l3d.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/system/zip_archive.h"
#include "lights/xml_values.h"

namespace lucerna {
namespace {

constexpr double kMostMetres = 1000;

// A frame in another one: columns are the axes.
struct Frame {
    std::array<V3d, 3> axes{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
    V3d origin{0, 0, 0};

    V3d turn(const V3d& v) const { return v.x * axes[0] + v.y * axes[1] + v.z * axes[2]; }
    Frame then(const Frame& inner) const {
        return {{turn(inner.axes[0]), turn(inner.axes[1]), turn(inner.axes[2])}, origin + turn(inner.origin)};
    }
};

Frame turn_about(int axis, double degrees) {
    // Whole quarters are exact.
    const double quarters = degrees / 90;
    double c = cos(degrees * kRadiansPerDegree), s = sin(degrees * kRadiansPerDegree);
    if (quarters == std::round(quarters)) c = std::round(c), s = std::round(s);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    Frame frame;
    frame.axes[static_cast<std::size_t>(a)][a] = c;
    frame.axes[static_cast<std::size_t>(a)][b] = s;
    frame.axes[static_cast<std::size_t>(b)][a] = -s;
    frame.axes[static_cast<std::size_t>(b)][b] = c;
    return frame;
}

Frame turned(const V3d& degrees) {
    return turn_about(2, degrees.z).then(turn_about(0, degrees.x)).then(turn_about(1, degrees.y));
}

// Returns the vector from a luminaire's frame to a lamp's, or back.
V3d flipped(const V3d& v) {
    return {v.x, -v.y, -v.z};
}
// Returns the axes of a lamp whose frame is `frame` in a luminaire.
std::array<V3d, 3> lamp_axes(const Frame& frame) {
    return {flipped(frame.axes[0]), flipped(-frame.axes[1]), flipped(-frame.axes[2])};
}

class Structure {
  public:
    Structure(std::string file, Monitor& monitor) : file_(std::move(file)), monitor_(monitor) {}

    // Visits a Geometry or a Joint that lies in `outer`.
    void visit(const XmlElement& part, const Frame& outer) {
        Frame frame = outer.then(placed(part));
        if (part.child("DefaultRotation"))
            frame = frame.then(turned(vector_of(part, "DefaultRotation", 1e6)));
        for (const auto& [list, item] : {std::pair("Joints", "Joint"), {"Geometries", "Geometry"}}) {
            if (const XmlElement* inner = part.child(list)) {
                for (const XmlElement* one : inner->all(item)) visit(*one, frame);
            }
        }
        if (const XmlElement* list = part.child("LightEmittingObjects")) {
            for (const XmlElement* object : list->all("LightEmittingObject")) add(*object, frame);
        }
    }
    std::vector<LightEmittingObject> objects;

  private:
    V3d vector_of(const XmlElement& part, std::string_view name, double most) const {
        const XmlElement* vector = part.child(name);
        if (!vector) input_error({file_, part.line, 1}, "<{}> lacks <{} x y z>", part.name, name);
        return {xml_attribute(*vector, "x", file_, -most, most),
                xml_attribute(*vector, "y", file_, -most, most),
                xml_attribute(*vector, "z", file_, -most, most)};
    }
    Frame placed(const XmlElement& part) const {
        Frame frame = turned(vector_of(part, "Rotation", 1e6));
        frame.origin = vector_of(part, "Position", kMostMetres);
        return frame;
    }
    // Heights are metres like all lengths of the format; files exist that state them in millimetres.
    std::array<double, 4> heights_of(const XmlElement& object) const {
        std::array<double, 4> heights{};
        const XmlElement* stated = object.child("LuminousHeights");
        if (!stated) return heights;
        constexpr std::string_view kNames[] = {"c0", "c90", "c180", "c270"};
        for (std::size_t i = 0; i < 4; ++i) heights[i] = xml_attribute(*stated, kNames[i], file_, 0, 1e5);
        if (*std::max_element(heights.begin(), heights.end()) < 1) return heights;
        monitor_.warn(fmt::format("{}: the luminous heights, up to {:g}, are read as millimetres",
                                  to_string(Location{file_, stated->line, 1}),
                                  *std::max_element(heights.begin(), heights.end())));
        for (double& height : heights) height /= 1000;
        return heights;
    }
    void add(const XmlElement& object, const Frame& outer) {
        using Shape = LuminousOpening::Shape;
        const Frame frame = outer.then(placed(object));
        const std::string* name = object.attribute("partName");
        LightEmittingObject found{name ? *name : std::string(), flipped(frame.origin), lamp_axes(frame), {}};
        const std::array<double, 4> heights = heights_of(object);
        if (const XmlElement* circle = object.child("Circle")) {
            const double d = xml_attribute(*circle, "diameter", file_, 0, kMostMetres);
            found.opening = LuminousOpening(Shape::cylinder_upright, d, d, heights);
        } else if (const XmlElement* rectangle = object.child("Rectangle")) {
            found.opening =
                LuminousOpening(Shape::box, xml_attribute(*rectangle, "sizeX", file_, 0, kMostMetres),
                                xml_attribute(*rectangle, "sizeY", file_, 0, kMostMetres), heights);
        } else {
            input_error({file_, object.line, 1},
                        "the light-emitting object \"{}\" has no shape; expected <Rectangle> or <Circle>",
                        shown_value(found.name));
        }
        objects.push_back(std::move(found));
    }

    std::string file_;
    Monitor& monitor_;
};

}  // namespace

std::array<V3d, 3> turned_axes(const V3d& degrees) {
    return lamp_axes(turned(degrees));
}

std::vector<LightEmittingObject> read_l3d(std::string bytes, const std::string& file, Monitor& monitor) {
    const ZipArchive archive(std::move(bytes), file);
    const auto entry = archive.find("structure.xml");
    if (!entry) input_error({file}, "the L3D archive has no structure.xml");
    const std::string name = archive.name(*entry);
    const XmlElement root = parse_xml(archive.text(*entry), name);
    const XmlElement* parts = root.child("Structure");
    if (root.name != "Luminaire" || !parts) {
        input_error({name, root.line, 1}, "the root is <{}>; expected <Luminaire> with a <Structure>",
                    shown_value(root.name));
    }
    Structure structure(name, monitor);
    for (const XmlElement* part : parts->all("Geometry")) structure.visit(*part, {});
    return std::move(structure.objects);
}

}  // namespace lucerna
