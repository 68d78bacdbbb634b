#include "engine/photometry/room.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/elementary.h"
#include "engine/photometry/edge_between.h"

namespace lucerna {
namespace {

constexpr double kLeastHeight = 2;      // m, of a room
constexpr double kBelowCeiling = 0.1;   // m, of the horizontal rays
constexpr double kLeastWidth = 0.5;     // m, of a wall
constexpr double kGap = 1.5;            // m, between points of one wall
constexpr double kRecess = 0.6;         // m
constexpr double kSamePlane = 0.05;     // m
constexpr double kSameFacing = 0.9986;  // cos 3°
constexpr int kDirections = 128;        // of the rays around a point
constexpr double kFarEdge = 100;        // m, at most, of an edge of the ceiling from a place
constexpr double kApart = 1;            // m, between places from which rays start
constexpr std::size_t kMostPlaces = 400;

// Casts rays in the scene between points of the world.
class Caster {
  public:
    explicit Caster(const Scene& scene) : scene_(scene) {}
    struct Found {
        V3d at, n;
        double distance;
    };
    std::optional<Found> cast(const V3d& from, const V3d& d) const {
        const auto hit = scene_.intersect(Ray{V3f(from - scene_.origin()), V3f(d)});
        if (!hit) return std::nullopt;
        const V3d n(face_forward(hit->at.n, -V3f(d)));
        return Found{V3d(hit->at.p) + scene_.origin(), n, double{hit->t}};
    }
    bool sees(const V3d& from, const V3d& to) const {
        const V3d way = to - from;
        const double distance = way.length();
        if (!(distance > 0)) return true;
        return !scene_.blocked(
            Ray{V3f(from - scene_.origin()), V3f(way / distance), static_cast<float>(distance * (1 - 1e-5))},
            false);
    }

  private:
    const Scene& scene_;
};

// Points of one plane that rays met.
struct Plane {
    struct Met {
        double at;       // along · p
        bool continued;  // the plane continues below
    };
    V3d n, along;   // unit, horizontal; n points into the room
    double offset;  // n · p
    std::vector<Met> met;
};

// A part of a plane without gaps.
struct Piece {
    V3d n, along;
    double offset, low, high;

    Wall wall(double floor, const V3d& up) const {
        const V3d middle = offset * n + floor * up;
        return {middle + low * along, middle + high * along, n};
    }
};

class Walls {
  public:
    Walls(const Scene& scene, const V3d& up, double floor, double sight)
        : caster_(scene), up_(up), floor_(floor), sight_(sight) {}

    // Looks around from a place at the height of sight. Returns places before what was seen.
    std::vector<V3d> look_around(const V3d& from) {
        std::vector<V3d> next;
        const V3d first = up_.cross(std::fabs(up_.x) > 0.5 ? V3d(0, 1, 0) : V3d(1, 0, 0));
        const V3d second = up_.cross(first);
        for (int i = 0; i < kDirections; ++i) {
            const double angle = 2 * kPiD * (i + 0.37) / kDirections;
            const V3d d = cos(angle) * first + sin(angle) * second;
            const auto found = caster_.cast(from, d);
            if (!found || !is_roofed(found->at - std::min(kRecess, 0.5 * found->distance) * d)) {
                edges_.push_back(from + roofed(from, d, found ? found->distance : kFarEdge) * d);
                if ((edges_.back() - from).length() > 2 * kRecess)
                    next.push_back(edges_.back() - kRecess * d);
                continue;
            }
            if (std::fabs(found->n.dot(up_)) > 0.2) continue;
            add(*found);
            if (found->distance > 2 * kRecess) next.push_back(found->at - kRecess * d);
        }
        return next;
    }
    // Where the room ends without a wall, as the ceiling does.
    const std::vector<V3d>& edges() const { return edges_; }

    std::vector<Wall> all() {
        std::vector<Piece> pieces;
        for (Plane& plane : planes_) add_pieces(plane, pieces);
        for (Piece& piece : pieces) extend(piece);
        const auto is_no_wall = [&pieces](const Piece& piece) {
            return piece.high - piece.low < kLeastWidth ||
                   std::ranges::any_of(pieces, [&](const Piece& other) { return is_recess(piece, other); });
        };
        std::vector<Wall> walls;
        for (const Piece& piece : pieces) {
            if (!is_no_wall(piece)) walls.push_back(piece.wall(floor_, up_));
        }
        return walls;
    }

  private:
    bool is_roofed(const V3d& point) const { return caster_.cast(point, up_).has_value(); }
    // Returns the distance along d at which there is nothing above for the first time, at most `most`.
    double roofed(const V3d& from, const V3d& d, double most) const {
        constexpr double kStep = 0.25, kExact = 1e-3;  // m
        double inside = 0, outside = 0;
        do {
            inside = outside;
            outside = std::min(inside + kStep, most);
            if (outside >= most) return most;
        } while (is_roofed(from + outside * d));
        return edge_between(inside, outside, kExact,
                            [&](double distance) { return is_roofed(from + distance * d); })
            .inside;
    }

    void add(const Caster::Found& found) {
        const V3d n = (found.n - found.n.dot(up_) * up_).normalized();
        const double offset = n.dot(found.at);
        auto plane = std::find_if(planes_.begin(), planes_.end(), [&](const Plane& known) {
            return known.n.dot(n) > kSameFacing &&
                   std::fabs(known.n.dot(found.at) - known.offset) < kSamePlane;
        });
        if (plane == planes_.end())
            plane = planes_.insert(plane, Plane{.n = n, .along = up_.cross(n), .offset = offset, .met = {}});
        // At half the height, windows and furniture may be before the wall or behind it.
        const double half = (found.at.dot(up_) - floor_) / 2;
        const auto below = caster_.cast(found.at + kRecess * n - half * up_, -n);
        plane->met.push_back({plane->along.dot(found.at), below && below->distance < 2 * kRecess});
    }

    // Adds the parts of a plane between its gaps, if a third of their points continue downwards.
    static void add_pieces(Plane& plane, std::vector<Piece>& pieces) {
        std::ranges::sort(plane.met, {}, &Plane::Met::at);
        for (std::size_t first = 0, end = 0; first < plane.met.size(); first = end) {
            std::size_t continued = 0;
            for (end = first; end < plane.met.size(); ++end) {
                if (end > first && plane.met[end].at - plane.met[end - 1].at > kGap) break;
                continued += plane.met[end].continued ? 1 : 0;
            }
            if (3 * continued >= end - first)
                pieces.push_back(
                    {plane.n, plane.along, plane.offset, plane.met[first].at, plane.met[end - 1].at});
        }
    }

    // Extends a wall to where it ends or the next one begins.
    void extend(Piece& piece) const {
        piece.low -= beyond(piece, piece.low, -1);
        piece.high += beyond(piece, piece.high, 1);
    }
    // Returns how far the plane continues from a point that was met, in the direction of `sign`.
    double beyond(const Piece& plane, double at, double sign) const {
        constexpr double kMost = 2, kStep = 0.1, kExact = 1e-4;  // m
        const V3d base = (plane.offset + kSamePlane) * plane.n + sight_ * up_;
        const auto corner = caster_.cast(base + at * plane.along, sign * plane.along);
        const double most = corner ? corner->distance : kMost;
        const auto continues = [&](double distance) {
            const auto met = caster_.cast(base + (at + sign * distance) * plane.along, -plane.n);
            return met && met->distance < 2 * kSamePlane;
        };
        double inside = 0;
        while (inside < most && continues(std::min(inside + kStep, most)))
            inside = std::min(inside + kStep, most);
        return edge_between(inside, std::min(inside + kStep, most), kExact, continues).outside;
    }

    static bool is_recess(const Piece& plane, const Piece& other) {
        const double behind = other.offset - plane.offset;
        return &plane != &other && plane.n.dot(other.n) > kSameFacing && behind > 0 && behind < kRecess &&
               plane.low > other.low - kRecess && plane.high < other.high + kRecess;
    }

    Caster caster_;
    V3d up_;
    double floor_, sight_;
    std::vector<Plane> planes_;
    std::vector<V3d> edges_;
};

// Returns what is met straight along `to`, up or down, from places all around a point and in sight of it.
std::vector<V3d> survey(const Caster& caster, const V3d& from, const V3d& up, const V3d& to) {
    constexpr int kAround = 16;
    constexpr double kFar = 10, kStep = 0.25;  // m
    const V3d first = up.cross(std::fabs(up.x) > 0.5 ? V3d(0, 1, 0) : V3d(1, 0, 0));
    const V3d second = up.cross(first);
    std::vector<V3d> found;
    for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * kPiD * (i + 0.37) / kAround;
        const V3d d = cos(angle) * first + sin(angle) * second;
        const auto wall = caster.cast(from, d);
        const double reach = wall ? std::min(wall->distance, kFar) : kFar;
        for (double at = 0.5 * kStep; at < reach; at += kStep) {
            if (const auto met = caster.cast(from + at * d, to)) found.push_back(met->at);
        }
    }
    std::sort(found.begin(), found.end(), [&](const V3d& p, const V3d& q) { return p.dot(up) < q.dot(up); });
    return found;
}

// Return a point of the most frequent height, and of the lowest height that a tenth of the points have, by
// points that ascend along `up`. Heights within 5 cm are the same. None if there is no point.
std::optional<V3d> of_most_frequent_height(const std::vector<V3d>& points, const V3d& up) {
    std::optional<V3d> best;
    std::size_t most = 0, end = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        while (end < points.size() && (points[end] - points[i]).dot(up) < kSamePlane) ++end;
        if (end - i > most) most = end - i, best = points[i + most / 2];
    }
    return best;
}
std::optional<V3d> of_lowest_height(const std::vector<V3d>& points, const V3d& up) {
    const std::size_t enough = std::max<std::size_t>(1, points.size() / 10);
    for (std::size_t i = 0; i + enough <= points.size(); ++i) {
        if ((points[i + enough - 1] - points[i]).dot(up) < kSamePlane) return points[i];
    }
    return std::nullopt;
}

// Returns the area within walls that form closed outlines [Green's theorem]; none if they do not.
std::optional<double> area_within(std::span<const Wall> walls, int up_axis) {
    constexpr double kTouching = 0.02;  // m
    const auto is_met = [&](const V3d& end) {
        return std::ranges::any_of(walls,
                                   [&](const Wall& next) { return (next.from - end).length() < kTouching; });
    };
    const int a = (up_axis + 1) % 3, b = (up_axis + 2) % 3;
    double twice = 0;
    for (const Wall& wall : walls) {
        if (!is_met(wall.to)) return std::nullopt;
        const V3d from = wall.from - walls.front().from, to = wall.to - walls.front().from;
        twice += from[a] * to[b] - from[b] * to[a];
    }
    return std::fabs(twice) / 2;
}

// Returns the median; 0 of no values.
double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

std::optional<Room> Room::around(const Scene& scene, std::span<const V3d> points, int up_axis) {
    const Caster caster(scene);
    V3d up(0);
    up[up_axis] = 1;
    Room room;
    room.up_axis_ = up_axis;
    // The median of what is above the points, luminaires perhaps, is below the ceiling or the ceiling.
    std::vector<V3d> above;
    for (const V3d& point : points) {
        if (const auto met = caster.cast(point, up)) above.push_back(met->at);
    }
    if (above.empty()) return std::nullopt;
    const auto median = above.begin() + static_cast<std::ptrdiff_t>(above.size() / 2);
    std::nth_element(above.begin(), median, above.end(),
                     [&](const V3d& p, const V3d& q) { return p[up_axis] < q[up_axis]; });
    const auto ceiling = of_most_frequent_height(survey(caster, *median - kBelowCeiling * up, up, up), up);
    if (!ceiling) return std::nullopt;
    room.ceiling_ = (*ceiling)[up_axis];
    room.sight_ = room.ceiling_ - kBelowCeiling;
    const V3d start = *ceiling - kBelowCeiling * up;
    const auto floor = of_lowest_height(survey(caster, start, up, -up), up);
    if (!floor || !(room.ceiling_ - (*floor)[up_axis] >= kLeastHeight)) return std::nullopt;
    room.floor_ = (*floor)[up_axis];

    Walls walls(scene, up, room.floor_, room.sight_);
    std::vector<V3d> waiting{start};
    while (!waiting.empty() && room.seen_from_.size() < kMostPlaces) {
        const V3d from = waiting.front();
        waiting.erase(waiting.begin());
        const bool is_near = std::any_of(room.seen_from_.begin(), room.seen_from_.end(),
                                         [&](const V3d& other) { return (other - from).length() < kApart; });
        if (is_near) continue;
        room.seen_from_.push_back(from);
        const std::vector<V3d> next = walls.look_around(from);
        waiting.insert(waiting.end(), next.begin(), next.end());
    }
    room.walls_ = walls.all();
    for (const Wall& wall : room.walls_) {
        room.bounds_.extendBy(wall.from);
        room.bounds_.extendBy(wall.to);
    }
    if (room.walls_.empty()) return std::nullopt;
    for (V3d edge : walls.edges()) {
        edge[up_axis] = room.floor_;
        room.bounds_.extendBy(edge);
    }
    room.bounds_.max[up_axis] = room.ceiling_;
    for (const int axis : {(up_axis + 1) % 3, (up_axis + 2) % 3}) {
        if (!(room.bounds_.size()[axis] >= kLeastWidth)) return std::nullopt;
    }
    return room;
}

bool Room::is_open_sided() const {
    return !area_within(walls_, up_axis_);
}

double Room::area(const Scene& scene) const {
    if (const auto area = area_within(walls_, up_axis_)) return *area;
    constexpr int kPoints = 100;  // along each side
    const int a = (up_axis_ + 1) % 3, b = (up_axis_ + 2) % 3;
    const V3d size = bounds_.size();
    int inside = 0;
    for (int i = 0; i < kPoints; ++i) {
        for (int j = 0; j < kPoints; ++j) {
            V3d p = bounds_.min;
            p[a] += (i + 0.5) / kPoints * size[a];
            p[b] += (j + 0.5) / kPoints * size[b];
            inside += holds(scene, p) ? 1 : 0;
        }
    }
    return size[a] * size[b] * inside / (kPoints * kPoints);
}

Room::Reflectances Room::reflectances(const Scene& scene) const {
    constexpr int kPoints = 24;    // along each side of a surface
    constexpr double kOff = 0.02;  // m, before it
    V3d up(0);
    up[up_axis_] = 1;
    std::vector<double> floor, ceiling, walls;
    const auto look = [&scene](const V3d& from, const V3d& d, std::vector<double>& met) {
        const auto hit = scene.intersect(Ray{V3f(from - scene.origin()), V3f(d)});
        if (hit && hit->t < 2 * kRecess) met.push_back(luminance(scene.bsdf(*hit).albedo(hit->wo)));
    };
    const V3d size = bounds_.size();
    const int a = (up_axis_ + 1) % 3, b = (up_axis_ + 2) % 3;
    double widest = 0;
    for (const Wall& wall : walls_) widest = std::max(widest, wall.width());
    for (int i = 0; i < kPoints; ++i) {
        for (int j = 0; j < kPoints; ++j) {
            const double s = (i + 0.5) / kPoints, t = (j + 0.5) / kPoints;
            V3d p = bounds_.min;
            p[a] += s * size[a];
            p[b] += t * size[b];
            if (holds(scene, p)) {
                look(p + kOff * up, -up, floor);
                p[up_axis_] = ceiling_ - kOff;
                look(p, up, ceiling);
            }
        }
    }
    // Points are as close on narrow walls as on wide ones.
    for (const Wall& wall : walls_) {
        const int columns = std::max(1, static_cast<int>(std::lround(kPoints * wall.width() / widest)));
        for (int i = 0; i < columns; ++i) {
            for (int j = 0; j < kPoints; ++j) {
                const V3d from = wall.from + (i + 0.5) / columns * (wall.to - wall.from) +
                                 (j + 0.5) / kPoints * (ceiling_ - floor_) * up + kOff * wall.inward;
                look(from, -wall.inward, walls);
            }
        }
    }
    return {median_of(std::move(floor)), median_of(std::move(walls)), median_of(std::move(ceiling))};
}

bool Room::is_open(const Scene& scene, const V3d& point) const {
    V3d above = point;
    above[up_axis_] = sight_;
    return Caster(scene).sees(point, above);
}

bool Room::holds(const Scene& scene, const V3d& point) const {
    const Caster caster(scene);
    V3d at = point;
    at[up_axis_] = sight_;
    return std::any_of(seen_from_.begin(), seen_from_.end(),
                       [&](const V3d& from) { return caster.sees(from, at); });
}

}  // namespace lucerna
