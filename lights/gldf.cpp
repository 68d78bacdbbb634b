#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/system/zip_archive.h"
#include "engine/text/plain_text.h"
#include "lights/l3d.h"
#include "lights/photometric_files.h"
#include "lights/xml_values.h"

namespace lucerna {
namespace {

constexpr double kMillimetre = 1e-3;
constexpr double kMostLumens = 1e12;

// Returns "a, b, c and 4 more".
std::string list_of(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 8;
    std::string list;
    for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i)
        list += (i == 0 ? "" : ", ") + shown_value(names[i]);
    if (names.size() > kMost) list += fmt::format(" and {} more", names.size() - kMost);
    return list;
}

std::string id_of(const XmlElement& element, std::string_view attribute = "id") {
    const std::string* id = element.attribute(attribute);
    return id ? *id : std::string();
}

bool is_light(const XmlElement& mode) {
    return mode.name.ends_with("LightEmitter");
}

// Reads one variant of a product.
class Gldf {
  public:
    Gldf(const ZipArchive& archive, std::string file, Monitor& monitor)
        : archive_(archive), file_(std::move(file)), monitor_(monitor) {
        const auto entry = archive_.find("product.xml");
        if (!entry) input_error({file_}, "the GLDF archive has no product.xml");
        product_ = archive_.name(*entry);
        root_ = parse_xml(archive_.text(*entry), product_);
        general_ = root_.child("GeneralDefinitions");
        if (root_.name != "Root" || !general_) {
            input_error({product_, root_.line, 1},
                        "the root is <{}>; expected <Root> with <GeneralDefinitions>, as GLDF 1.0 has",
                        shown_value(root_.name));
        }
    }

    std::vector<LuminaireEmitter> emitters(const std::string& variant) {
        const XmlElement& chosen = variant_of(variant);
        std::vector<LuminaireEmitter> found;
        for (const Reference& reference : references_of(chosen)) {
            auto emitter = read(*reference.emitter);
            if (!emitter) continue;
            if (reference.object) {
                emitter->position = reference.object->position;
                emitter->axes = reference.object->axes;
                if (reference.object->opening.faces().second > 0)
                    emitter->web.set_opening(reference.object->opening);
            }
            found.push_back(std::move(*emitter));
        }
        if (found.empty()) {
            input_error(at(chosen), "the variant \"{}\" has no emitter of light", shown_value(id_of(chosen)));
        }
        return found;
    }

  private:
    // An emitter of the variant, and the object from which it shines if the geometry has one.
    struct Reference {
        const XmlElement* emitter;
        std::optional<LightEmittingObject> object;
    };
    struct Source {
        const XmlElement* photometry = nullptr;  // a PhotometryReference
        double lumens = 0, watts = 0;            // 0: not stated
    };

    Location at(const XmlElement& element) const { return {product_, element.line, 1}; }
    const XmlElement& by_id(const char* list, const XmlElement& user, std::string_view attribute) const;
    const XmlElement& variant_of(const std::string& id);
    std::vector<Reference> references_of(const XmlElement& variant);
    void add_model(const XmlElement& model, std::vector<Reference>& references);
    LightEmittingObject simple_object(const XmlElement& reference) const;
    const XmlElement* mode_of(const XmlElement& emitter);
    std::optional<LuminaireEmitter> read(const XmlElement& emitter);
    std::vector<Source> sources_of(const XmlElement& mode) const;
    PhotometricWeb web_of(const Source& source);
    std::pair<std::string, std::string> content_of(const XmlElement& reference) const;

    const ZipArchive& archive_;
    std::string file_, product_;
    Monitor& monitor_;
    XmlElement root_;
    const XmlElement* general_ = nullptr;
};

// Returns the element of the list, for example an Emitter of Emitters, whose id the attribute names.
const XmlElement& Gldf::by_id(const char* list, const XmlElement& user, std::string_view attribute) const {
    const std::string id = id_of(user, attribute);
    if (const XmlElement* all = general_->child(list)) {
        for (const XmlElement& one : all->children) {
            if (id_of(one) == id) return one;
        }
    }
    input_error(at(user), "{} is \"{}\", which no element of <{}> has as its id", attribute, shown_value(id),
                list);
}

const XmlElement& Gldf::variant_of(const std::string& id) {
    const XmlElement* list = root_.find("Variants");
    const std::vector<const XmlElement*> variants =
        list ? list->all("Variant") : std::vector<const XmlElement*>();
    if (variants.empty()) input_error({product_}, "the product has no <Variant>");
    std::vector<std::string> names;
    for (const XmlElement* variant : variants) names.push_back(id_of(*variant));
    if (!id.empty()) {
        const auto found = std::find(names.begin(), names.end(), id);
        if (found != names.end()) return *variants[static_cast<std::size_t>(found - names.begin())];
        input_error({product_}, "no variant is called \"{}\"; expected one of {}", shown_value(id),
                    list_of(names));
    }
    if (variants.size() > 1) {
        monitor_.warn(fmt::format("{}: {} variants ({}); the first is used, and \"{}#NAME\" names another",
                                  product_, variants.size(), list_of(names), file_));
    }
    return *variants.front();
}

std::vector<Gldf::Reference> Gldf::references_of(const XmlElement& variant) {
    std::vector<Reference> references;
    const XmlElement* geometry = variant.child("Geometry");
    if (geometry && geometry->child("GeometryReferences")) geometry = geometry->child("GeometryReferences");
    if (geometry) {
        for (const XmlElement* plain : geometry->all("EmitterReference"))
            references.push_back({&by_id("Emitters", *plain, "emitterId"), {}});
        if (const XmlElement* model = geometry->child("ModelGeometryReference")) {
            add_model(*model, references);
        } else if (const XmlElement* simple = geometry->child("SimpleGeometryReference")) {
            references.push_back({&by_id("Emitters", *simple, "emitterId"), simple_object(*simple)});
        }
    }
    if (!references.empty()) return references;
    const XmlElement* emitters = general_->child("Emitters");
    if (!emitters || emitters->all("Emitter").size() != 1) {
        input_error(at(variant),
                    "the variant \"{}\" names no emitter; expected an <EmitterReference> in its <Geometry>",
                    shown_value(id_of(variant)));
    }
    monitor_.warn(fmt::format("{}: the variant names no emitter; the only one of the product is used",
                              to_string(at(variant))));
    return {{emitters->child("Emitter"), {}}};
}

void Gldf::add_model(const XmlElement& model, std::vector<Reference>& references) {
    std::vector<LightEmittingObject> objects;
    const XmlElement* l3d = nullptr;
    const XmlElement& geometry = by_id("Geometries", model, "geometryId");
    for (const XmlElement* one : geometry.all("GeometryFileReference")) {
        if (!l3d && id_of(by_id("Files", *one, "fileId"), "contentType") == "geo/l3d") l3d = one;
    }
    if (l3d) {
        auto [bytes, name] = content_of(*l3d);
        objects = read_l3d(std::move(bytes), name, monitor_);
    } else {
        monitor_.warn(
            fmt::format("{}: the model is in no L3D file; the emitters are at the place of the lamp, "
                        "with the openings of their photometries",
                        to_string(at(geometry))));
    }
    for (const XmlElement* one : model.all("EmitterReference")) {
        const std::string target = id_of(*one, "targetModelType");
        if (!target.empty() && target != "l3d") continue;
        Reference reference{&by_id("Emitters", *one, "emitterId"), {}};
        if (std::ranges::none_of(reference.emitter->children, is_light)) continue;  // a sensor
        if (l3d) {
            const std::string name(one->text_of("EmitterObjectExternalName"));
            const auto found = std::ranges::find(objects, name, &LightEmittingObject::name);
            if (found == objects.end()) {
                std::vector<std::string> names;
                for (const LightEmittingObject& object : objects) names.push_back(object.name);
                input_error(at(*one), "no light-emitting object of the L3D file is called \"{}\"; it has {}",
                            shown_value(name), names.empty() ? "none" : list_of(names));
            }
            reference.object = *found;
        }
        references.push_back(std::move(reference));
    }
}

// Returns the opening that the product itself states, at the place of the lamp.
LightEmittingObject Gldf::simple_object(const XmlElement& reference) const {
    using Shape = LuminousOpening::Shape;
    const XmlElement& geometry = by_id("Geometries", reference, "geometryId");
    LightEmittingObject object{{}, {0, 0, 0}, turned_axes({0, 0, 0}), {}};
    std::array<double, 4> heights{};
    if (const XmlElement* stated = geometry.child("C-Heights")) {
        constexpr std::string_view kNames[] = {"C0", "C90", "C180", "C270"};
        for (std::size_t i = 0; i < 4; ++i)
            heights[i] = kMillimetre * xml_child(*stated, kNames[i], product_, 0, 1e6, 0);
    }
    const auto size = [&](const XmlElement& shape, const char* name) {
        return kMillimetre * xml_child(shape, name, product_, 0, 1e6, 0);
    };
    if (const XmlElement* circle = geometry.child("CircularEmitter")) {
        const double d = size(*circle, "Diameter");
        object.opening = LuminousOpening(Shape::cylinder_upright, d, d, heights);
    } else if (const XmlElement* rectangle = geometry.child("RectangularEmitter")) {
        object.opening =
            LuminousOpening(Shape::box, size(*rectangle, "Width"), size(*rectangle, "Length"), heights);
    }
    return object;
}

// Returns the mode of operation that is used; null for a sensor, and for light in emergencies alone. The
// modes of an emitter exclude each other.
const XmlElement* Gldf::mode_of(const XmlElement& emitter) {
    const XmlElement* chosen = nullptr;
    int modes = 0;
    for (const XmlElement& mode : emitter.children) {
        if (!is_light(mode)) continue;
        ++modes;
        if (!chosen && id_of(mode, "emergencyBehaviour") != "EmergencyOnly") chosen = &mode;
    }
    if (modes > 1 && chosen) {
        monitor_.warn(fmt::format("{}: the emitter \"{}\" has {} modes; that of line {} is used",
                                  to_string(at(emitter)), shown_value(id_of(emitter)), modes, chosen->line));
    } else if (modes > 0 && !chosen) {
        monitor_.warn(fmt::format("{}: the emitter \"{}\" shines in emergencies alone and is left out",
                                  to_string(at(emitter)), shown_value(id_of(emitter))));
    }
    return chosen;
}

std::optional<LuminaireEmitter> Gldf::read(const XmlElement& emitter) {
    const XmlElement* mode = mode_of(emitter);
    if (!mode) return std::nullopt;
    std::vector<LuminaireEmitter> channels;
    for (const Source& source : sources_of(*mode)) {
        if (!source.photometry) input_error(at(*mode), "<{}> has no <PhotometryReference>", mode->name);
        channels.push_back({web_of(source)});
    }
    if (channels.empty()) input_error(at(*mode), "<{}> has no channel with a photometry", mode->name);
    if (channels.size() > 1) {
        monitor_.warn(fmt::format("{}: {} channels are added up at full power, without their colours",
                                  to_string(at(*mode)), channels.size()));
    }
    LuminaireEmitter whole{luminaire_web(channels)};
    if (const XmlElement* rotation = mode->child("Rotation")) {
        const auto angle = [&](const char* name) {
            return xml_child(*rotation, name, product_, -360, 360, 0);
        };
        // G0 turns the photometry about its own axis first.
        LuminaireEmitter tilted{whole.web, {0, 0, 0}, turned_axes({angle("X"), angle("Y"), angle("Z")})};
        const std::array<V3d, 3> about_g0 = turned_axes({0, 0, angle("G0")});
        for (std::size_t i = 0; i < 3; ++i) whole.axes[i] = tilted.to_luminaire(about_g0[i]);
        whole = {luminaire_web({whole})};
    }
    return whole;
}

// Returns the photometries of a mode with the flux that the product states for each.
std::vector<Gldf::Source> Gldf::sources_of(const XmlElement& mode) const {
    const auto lumens_of = [&](const XmlElement& element) {
        return xml_child(element, "RatedLuminousFlux", product_, 0, kMostLumens, 0);
    };
    const auto add = [&](Source& source, const XmlElement& element, double count) {
        if (!source.photometry) source.photometry = element.child("PhotometryReference");
        if (!(source.lumens > 0)) source.lumens = count * lumens_of(element);
        if (!(source.watts > 0))
            source.watts = count * xml_child(element, "RatedInputPower", product_, 0, 1e9, 0);
    };
    Source source;
    add(source, mode, 1);
    const XmlElement* user = &mode;
    if (const XmlElement* reference = mode.child("EquipmentReference")) {
        user = &by_id("Equipments", *reference, "equipmentId");
        add(source, *user, 1);
    }
    const XmlElement* light = user->child("LightSourceReference");
    if (!light) return {source};
    const XmlElement* lamp = nullptr;
    for (const char* name : {"fixedLightSourceId", "changeableLightSourceId", "multiChannelLightSourceId"}) {
        if (light->attribute(name)) lamp = &by_id("LightSources", *light, name);
    }
    if (!lamp) return {source};
    if (const XmlElement* channels = lamp->child("Channels")) {
        std::vector<Source> all;
        for (const XmlElement* channel : channels->all("Channel")) add(all.emplace_back(), *channel, 1);
        return all;
    }
    const bool counted = light->attribute("lightSourceCount") != nullptr;
    add(source, *lamp, counted ? xml_attribute(*light, "lightSourceCount", product_, 1, 1e6) : 1);
    return {source};
}

// The product's flux replaces that of the photometry's lamps, whose light output ratio stays; for absolute
// photometry it replaces the luminaire's.
PhotometricWeb Gldf::web_of(const Source& source) {
    const XmlElement& photometry = by_id("Photometries", *source.photometry, "photometryId");
    const XmlElement* reference = photometry.child("PhotometryFileReference");
    if (!reference) input_error(at(photometry), "the photometry has no <PhotometryFileReference>");
    const auto [bytes, name] = content_of(*reference);
    const PhotometricWeb given = luminaire_web(parse_luminaire(bytes, name, monitor_));
    PhotometricInfo info = given.info();
    if (source.watts > 0) info.watts = source.watts;
    const double stated = info.lamp_lumens > 0 ? info.lamp_lumens : given.flux();
    if (!(source.lumens > 0 && stated > 0)) return PhotometricWeb(given.grid(), std::move(info));
    if (info.lamp_lumens > 0) info.lamp_lumens = source.lumens;
    return PhotometricWeb(scaled(given, source.lumens / stated).grid(), std::move(info));
}

// Returns the bytes and the name of the file that the element's fileId names.
std::pair<std::string, std::string> Gldf::content_of(const XmlElement& reference) const {
    const XmlElement& file = by_id("Files", reference, "fileId");
    if (id_of(file, "type") == "url") {
        input_error(at(file), "the file \"{}\" is not in the archive but on the web; download it and read it",
                    shown_value(file.text));
    }
    const std::string type = id_of(file, "contentType");
    for (const std::string& path : {type.substr(0, type.find('/')) + "/" + file.text, file.text}) {
        if (const auto entry = archive_.find(path)) return {archive_.text(*entry), archive_.name(*entry)};
    }
    input_error(at(file), "the archive has no file {}/{}", type.substr(0, type.find('/')),
                shown_value(file.text));
}

}  // namespace

std::vector<LuminaireEmitter> read_gldf(const ZipArchive& archive, const std::string& file,
                                        const std::string& variant, Monitor& monitor) {
    return Gldf(archive, file, monitor).emitters(variant);
}

}  // namespace lucerna
