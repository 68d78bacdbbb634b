#include "engine/photometry/en12464.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr double kSurround = 0.5, kBackground = 3;  // m, widths of the bands
constexpr double kUniformSurround = 0.4, kUniformElsewhere = 0.1;
constexpr double kOffSurface = 0.01;  // m, of points from walls and ceiling
// m: an observer's distance from what is behind, the steps in which it is found, the farthest, and the least
// width of the wall
constexpr double kOffWall = 0.25, kStepOffWall = 0.05, kFarthestOffWall = 2.5, kLeastWall = 2;

std::string names() {
    std::vector<std::string> all;
    for (const RequirementName& requirement : kRequirements) all.emplace_back(requirement.name);
    return fmt::format("{}", fmt::join(all, ", "));
}

RequiredRange parse_range(const Location& at, Requirement requirement, std::string_view word) {
    constexpr double kMost = 1e6;
    if (requirement == Requirement::ugr) return {0, parse_number(at, word, 0, 100)};
    if (requirement == Requirement::ra) return {parse_number(at, word, 0, 100), 0};
    if (requirement == Requirement::u0) return {parse_number(at, word, 0, 1), 0};
    if (requirement != Requirement::modelling) return {parse_number(at, word, 0, kMost), 0};
    const std::size_t dash = word.find('-');
    if (dash == word.npos) input_error(at, "{} is not a range; expected for example 0.3-0.6", one_line(word));
    const RequiredRange limits{parse_number(at, word.substr(0, dash), 0, 10),
                               parse_number(at, word.substr(dash + 1), 0, 10)};
    if (!(limits.high > limits.low)) {
        input_error(at, "{} is an empty range; expected the lower end first, for example 0.3-0.6",
                    one_line(word));
    }
    return limits;
}

// Makes the surfaces of one scene.
class Builder {
  public:
    Builder(const Scene& scene, const Requirements& requirements, double eye_height, int up_axis,
            bool right_handed)
        : scene_(scene),
          requirements_(requirements),
          eye_height_(eye_height),
          axis_(up_axis),
          right_handed_(right_handed),
          up_(0) {
        up_[up_axis] = 1;
    }

    RoomSurfaces all(std::span<const CalculationSurface> tasks) {
        for (const CalculationSurface& task : tasks) add(Area::task, task);
        for (const CalculationSurface& task : tasks) {
            const auto room = room_of(task);
            if (!room) continue;
            if (needs(Requirement::surround)) add(Area::surround, surround(task, *room));
            if (needs(Requirement::background) && task.is_level(axis_))
                add(Area::background, background(task, *room));
        }
        for (std::size_t i = 0; i < made_.rooms.size(); ++i)
            add_room(made_.rooms[i], made_.rooms.size() > 1 ? fmt::format("room {}: ", i + 1) : "");
        return std::move(made_);
    }

  private:
    bool needs(Requirement one) const { return required(requirements_, one).has_value(); }
    bool needs_room() const {
        return std::any_of(requirements_.begin() + static_cast<std::ptrdiff_t>(Requirement::surround),
                           requirements_.end(), [](const auto& limits) { return limits.has_value(); });
    }
    void add(Area area, CalculationSurface surface) {
        // A band that lies outside the room altogether does not exist.
        if (!surface.excluded.empty() && std::ranges::all_of(surface.excluded, [](bool out) { return out; }))
            return;
        made_.surfaces.push_back(std::move(surface));
        made_.areas.push_back(area);
    }

    // Returns the room around a task area; one that is already known if it is the same.
    std::optional<Room> room_of(const CalculationSurface& task) {
        std::vector<V3d> points;
        for (int y = 0; y < task.points.y; ++y) {
            for (int x = 0; x < task.points.x; ++x) points.push_back(task.position(x, y));
        }
        const V3d& middle = points[points.size() / 2];
        for (const Room& room : made_.rooms) {
            if (middle[axis_] > room.floor() && middle[axis_] < room.ceiling() && room.holds(scene_, middle))
                return room;
        }
        const auto room = Room::around(scene_, points, axis_);
        if (room) made_.rooms.push_back(*room);
        if (!room && needs_room()) {
            throw InputError({"--require"},
                             fmt::format("there is no room around \"{}\": a floor, a ceiling at least 2 m "
                                         "above it, and walls; only Em and U0 can be required here",
                                         plain_text(task.name)));
        }
        return room;
    }

    // Leaves out the points that are within the inner area or outside the room.
    void leave_out(CalculationSurface& surface, const Room& room, const CalculationSurface* inner) const {
        surface.excluded.clear();
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                const V3d p = surface.position(x, y);
                bool out = !room.holds(scene_, p);
                if (inner != nullptr) {
                    // The sides may be of any angle; the projection along `up` does not matter to them.
                    const V3d from = p - inner->corner, n = inner->u.cross(inner->v);
                    const double u = from.cross(inner->v).dot(n) / n.dot(n),
                                 v = inner->u.cross(from).dot(n) / n.dot(n);
                    out = out || (u > 0 && u < 1 && v > 0 && v < 1);
                }
                surface.excluded.push_back(out);
            }
        }
        crop(surface);
    }

    // Crops the surface to the rows and columns with points that count.
    static void crop(CalculationSurface& surface) {
        V2i low = surface.points, high(0);
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                if (!surface.counts(x, y)) continue;
                low = {std::min(low.x, x), std::min(low.y, y)};
                high = {std::max(high.x, x + 1), std::max(high.y, y + 1)};
            }
        }
        if (low.x >= high.x) return;
        CalculationSurface cropped = surface;
        cropped.points = high - low;
        const V3d u = surface.u / double(surface.points.x), v = surface.v / double(surface.points.y);
        cropped.corner = surface.corner + double(low.x) * u + double(low.y) * v;
        cropped.u = double(cropped.points.x) * u;
        cropped.v = double(cropped.points.y) * v;
        cropped.excluded.clear();
        for (int y = low.y; y < high.y; ++y) {
            for (int x = low.x; x < high.x; ++x) cropped.excluded.push_back(!surface.counts(x, y));
        }
        surface = std::move(cropped);
    }

    // Returns the area that is wider by `width` on all sides, with points about as far apart.
    static CalculationSurface widened(const CalculationSurface& area, double width) {
        CalculationSurface wide = area;
        const V3d u = area.u.normalized(), v = area.v.normalized();
        wide.corner -= width * (u + v);
        wide.u += 2 * width * u;
        wide.v += 2 * width * v;
        const double spacing = std::max(area.u.length() / area.points.x, area.v.length() / area.points.y);
        wide.points = points_apart(wide.u.length(), wide.v.length(), std::min(spacing, width));
        return wide;
    }
    CalculationSurface surround(const CalculationSurface& task, const Room& room) const {
        CalculationSurface band = widened(task, kSurround);
        band.name = task.name + ": surround";
        leave_out(band, room, &task);
        return band;
    }
    CalculationSurface background(const CalculationSurface& task, const Room& room) const {
        CalculationSurface inner = widened(task, kSurround);
        inner.corner[axis_] = room.floor();
        inner.u[axis_] = inner.v[axis_] = 0;
        inner.points = default_points(inner.u.length(), inner.v.length());
        CalculationSurface band = widened(inner, kBackground);
        band.name = task.name + ": background";
        band.normal = band.up = V3f(up_);
        band.kind = ReceiverKind::planar;
        leave_out(band, room, &inner);
        return band;
    }

    // Returns a level rectangle across the room's bounds, whose first side times the second points upwards.
    CalculationSurface level(const Room& room, double height, const std::string& name,
                             int more_points = 0) const {
        CalculationSurface surface;
        surface.name = name;
        surface.corner = room.bounds().min;
        surface.corner[axis_] = height;
        const V3d size = room.bounds().size();
        const int a = (axis_ + 1) % 3, b = (axis_ + 2) % 3;
        surface.u = surface.v = V3d(0);
        surface.u[a] = size[a];
        surface.v[b] = size[b];
        surface.normal = surface.up = V3f(up_);
        surface.points = default_points(size[a], size[b]) + V2i(more_points);
        leave_out(surface, room, nullptr);
        return surface;
    }

    void add_room(const Room& room, const std::string& prefix) {
        if (needs(Requirement::walls)) {
            for (std::size_t i = 0; i < room.walls().size(); ++i)
                add(Area::wall, wall(room, room.walls()[i], fmt::format("{}wall {}", prefix, i + 1)));
        }
        if (needs(Requirement::ceiling)) {
            add(Area::ceiling, ceiling(room, prefix + "ceiling"));
        }
        const double eyes = room.floor() + eye_height_;
        if (needs(Requirement::ez) || needs(Requirement::modelling)) {
            CalculationSurface cylinders =
                level(room, eyes, fmt::format("{}cylindrical, {:g} m high", prefix, eye_height_));
            cylinders.kind = ReceiverKind::cylindrical;
            add(Area::cylindrical, std::move(cylinders));
        }
        if (needs(Requirement::modelling))
            add(Area::horizontal,
                level(room, eyes, fmt::format("{}horizontal, {:g} m high", prefix, eye_height_)));
        if (needs(Requirement::ugr)) add_observers(room, prefix);
    }

    CalculationSurface wall(const Room& room, const Wall& wall, const std::string& name) const {
        CalculationSurface surface;
        surface.name = name;
        surface.corner = wall.from + kOffSurface * wall.inward;
        surface.u = wall.to - wall.from;
        surface.v = (room.ceiling() - room.floor()) * up_;
        surface.normal = V3f(wall.inward);
        surface.up = V3f(up_);
        surface.points = default_points(surface.u.length(), surface.v.length());
        leave_out_hidden(surface);
        return surface;
    }

    // Leaves out points of a wall or ceiling that furniture or luminaires hide, less than 0.3 m before them.
    void leave_out_hidden(CalculationSurface& surface) const {
        constexpr float kHidden = 0.3F;  // m
        surface.excluded.resize(surface.size());
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                const V3f from(surface.position(x, y) - scene_.origin());
                if (scene_.blocked(Ray{from, surface.normal, kHidden}, false))
                    surface.excluded[surface.index(x, y)] = true;
            }
        }
    }

    // Luminaires may be above each point of a grid; then one with more points meets what is between them.
    CalculationSurface ceiling(const Room& room, const std::string& name) const {
        constexpr int kTries = 4;
        CalculationSurface surface;
        for (int more = 0; more < kTries; ++more) {
            surface = level(room, room.ceiling() - kOffSurface, name, more);
            surface.normal = V3f(-up_);
            leave_out_hidden(surface);
            const auto hidden = static_cast<std::size_t>(std::ranges::count(surface.excluded, true));
            if (2 * hidden < surface.size()) break;
        }
        return surface;
    }

    // CIE 117's standard positions: the middle of each side of the room, looking across it. Where furniture
    // is in the way, the observer stands before it.
    void add_observers(const Room& room, const std::string& prefix) {
        for (std::size_t i = 0; i < room.walls().size(); ++i) {
            const Wall& wall = room.walls()[i];
            if (wall.width() < kLeastWall) continue;
            const V3d middle = (wall.from + wall.to) / 2 + eye_height_ * up_;
            const auto is_open = [&](double off) { return room.is_open(scene_, middle + off * wall.inward); };
            double off = kOffWall;
            while (off < kFarthestOffWall && !is_open(off)) off += kStepOffWall;
            if (off >= kFarthestOffWall) continue;
            // Furniture is as far behind the eye as the wall is elsewhere, if there is room for that.
            if (off > kOffWall && is_open(off + kOffWall)) off += kOffWall;
            made_.observers.push_back({fmt::format("{}before wall {}", prefix, i + 1),
                                       middle + off * wall.inward, V3f(wall.inward), V3f(up_),
                                       right_handed_});
        }
    }

    const Scene& scene_;
    const Requirements& requirements_;
    double eye_height_;
    int axis_;
    bool right_handed_;
    V3d up_;

    RoomSurfaces made_;
};

// The requirement of an area's mean illuminance, and the least uniformity that goes with it (0: none).
struct AreaRule {
    Area area;
    Requirement requirement;
    double uniformity;
};
constexpr AreaRule kRules[] = {{Area::task, Requirement::em, 0},
                               {Area::surround, Requirement::surround, kUniformSurround},
                               {Area::background, Requirement::background, kUniformElsewhere},
                               {Area::wall, Requirement::walls, kUniformElsewhere},
                               {Area::ceiling, Requirement::ceiling, kUniformElsewhere},
                               {Area::cylindrical, Requirement::ez, kUniformElsewhere}};

// Judges the uniformity of a surface. It is undecided if no light was found at the darkest point, because it
// is not known then how little there is.
Verdict verdict_of_uniformity(const SurfaceIlluminance& surface, const RequiredRange& range) {
    const bool is_found = surface.least.value > 0;
    return is_found ? verdict_of(surface.uniformity, range) : Verdict::undecided;
}

// Returns R_a of a surface's mean light, with its error by intervals of wavelengths in the interval; NaN if
// it was not computed.
Reading95 colour_rendering(const ColourReport& colour, std::size_t surface) {
    constexpr std::size_t kRa = 2;
    static_assert(kColourQuantities[kRa].name == "R_a");
    if (colour.surfaces.empty()) return {NAN, 0};
    const LightColour& mean = colour.surfaces[surface].mean;
    return {mean.values[kRa].value, mean.values[kRa].half_width + mean.by_intervals[kRa]};
}

Reading95 ratio(const Reading95& a, const Reading95& b) {
    if (!(b.value > 0)) return {0, 0};
    const double value = a.value / b.value;
    // To first order, as if both were independent.
    return {value, hypot(a.half_width, value * b.half_width) / b.value};
}

}  // namespace

double surround_of(double task) {
    if (task >= 750) return 500;
    if (task >= 500) return 300;
    if (task >= 300) return 200;
    return task >= 200 ? 150 : task;
}

Requirements parse_requirements(const Location& at, std::string_view word) {
    Requirements all;
    for (std::string_view rest = word; !rest.empty();) {
        const std::size_t comma = rest.find(',');
        const std::string_view one = trimmed(rest.substr(0, comma));
        rest.remove_prefix(comma == rest.npos ? rest.size() : comma + 1);
        const std::size_t equals = one.find('=');
        const auto found = std::find_if(kRequirements.begin(), kRequirements.end(),
                                        [&](const auto& r) { return one.substr(0, equals) == r.name; });
        if (found == kRequirements.end() || equals == one.npos) {
            input_error(
                at,
                "\"{}\" is not a requirement; expected NAME=VALUE with the names {}, or TABLE.csv#REFERENCE",
                one_line(one), names());
        }
        const auto index = static_cast<std::size_t>(found - kRequirements.begin());
        if (all[index]) input_error(at, "{} is given twice", found->name);
        try {
            all[index] = parse_range(at, static_cast<Requirement>(index), trimmed(one.substr(equals + 1)));
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}, for {}", error.what(), found->name));
        }
    }
    return all;
}

RoomSurfaces room_surfaces(const Scene& scene, std::span<const CalculationSurface> tasks,
                           const Requirements& requirements, double eye_height, int up_axis,
                           bool right_handed) {
    return Builder(scene, requirements, eye_height, up_axis, right_handed).all(tasks);
}

Verdict verdict_of(const Reading95& value, const RequiredRange& limits) {
    const double least = value.value - value.half_width, most = value.value + value.half_width;
    const bool bounded = limits.high > 0;
    if (least >= limits.low && (!bounded || most <= limits.high)) return Verdict::met;
    return most < limits.low || (bounded && least > limits.high) ? Verdict::missed : Verdict::undecided;
}

std::vector<Judgement> judge(const RoomSurfaces& room, std::span<const SurfaceIlluminance> surfaces,
                             std::span<const GlareReport> glare, const ColourReport& colour,
                             const Requirements& requirements) {
    std::vector<Judgement> all;
    const auto add = [&all](const std::string& what, const std::string& of, const char* unit,
                            const Reading95& value, const RequiredRange& limits) {
        all.push_back({what, of, unit, value, limits, verdict_of(value, limits)});
    };
    const auto add_uniformity = [&all](const SurfaceIlluminance& surface, const RequiredRange& range) {
        all.push_back({"U0", surface.surface.name, "", surface.uniformity, range,
                       verdict_of_uniformity(surface, range)});
    };
    for (const AreaRule& rule : kRules) {
        const auto& limits = required(requirements, rule.requirement);
        const char* name = kRequirements[static_cast<std::size_t>(rule.requirement)].name;
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            if (room.areas[i] != rule.area) continue;
            const SurfaceIlluminance& surface = surfaces[i];
            if (limits) add(name, surface.surface.name, "lx", surface.mean, *limits);
            if (limits && rule.uniformity > 0) add_uniformity(surface, {rule.uniformity, 0});
            if (const auto& u0 = required(requirements, Requirement::u0); u0 && rule.area == Area::task)
                add_uniformity(surface, *u0);
        }
    }
    if (const auto& limits = required(requirements, Requirement::ra)) {
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            if (room.areas[i] == Area::task)
                add("Ra", surfaces[i].surface.name, "", colour_rendering(colour, i), *limits);
        }
    }
    if (const auto& limits = required(requirements, Requirement::modelling)) {
        for (std::size_t i = 0; i + 1 < surfaces.size(); ++i) {
            if (room.areas[i] != Area::cylindrical || room.areas[i + 1] != Area::horizontal) continue;
            add("modelling", surfaces[i].surface.name, "", ratio(surfaces[i].mean, surfaces[i + 1].mean),
                *limits);
        }
    }
    if (const auto& limits = required(requirements, Requirement::ugr)) {
        for (const GlareReport& report : glare) {
            // No luminaire in sight glares less than any limit.
            const Reading95 rating = std::isinf(report.ugr.value) ? Reading95{0, 0} : report.ugr;
            add("UGR", report.observer.name, "", rating, *limits);
        }
    }
    return all;
}

}  // namespace lucerna
