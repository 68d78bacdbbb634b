#include "lights/lumigraph.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

constexpr double kOrthonormal = 1e-9;  // tolerance of lengths and angles; a file holds doubles

constexpr const char* kSideNames[] = {"+z", "-z", "+x", "-x", "+y", "-y"};

bool is_finite(const V3d& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

}  // namespace

std::string SlabAxes::fault() const {
    const double off[] = {u.dot(u) - 1, v.dot(v) - 1, n.dot(n) - 1, u.dot(v), (u.cross(v) - n).length()};
    for (const double x : off) {
        if (!(std::fabs(x) <= kOrthonormal))  // also refuses NaN
            return fmt::format("axes ({}, {}, {}), ({}, {}, {}), which are not orthonormal", u.x, u.y, u.z,
                               v.x, v.y, v.z);
    }
    return {};
}

SlabAxes SlabAxes::facing(int side) {
    // The axes are turned by quarters: u stays horizontal, and v points up as seen towards the lamp (its +z).
    switch (side) {
        case 0:
            return {};
        case 1:
            return {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
        case 2:
            return {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
        case 3:
            return {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}};
        case 4:
            return {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}};
        default:
            return {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
    }
}

std::string SlabAxes::name() const {
    for (int side = 0; side < kSides; ++side) {
        if (n == facing(side).n) return kSideNames[side];
    }
    return fmt::format("({:.4g}, {:.4g}, {:.4g})", n.x, n.y, n.z);
}

SlabShares::SlabShares(std::vector<V3d> normals) : normals_(std::move(normals)) {
    // Without three independent normals, some directions are far from all of them.
    bool space = false;
    for (const V3d& a : normals_) {
        for (const V3d& b : normals_) {
            for (const V3d& c : normals_) space |= std::fabs(a.cross(b).dot(c)) > 0.5;
        }
    }
    cut_ = space ? kCut : 0.0;
}

void SlabShares::of(const V3d& d, std::span<double> shares) const {
    double sum = 0;
    for (std::size_t i = 0; i < normals_.size(); ++i) {
        shares[i] = sqr(std::max(0.0, d.dot(normals_[i]) - cut_));
        sum += shares[i];
    }
    for (std::size_t i = 0; i < normals_.size(); ++i) shares[i] = sum > 0 ? shares[i] / sum : 0.0;
}

Lumigraph::Lumigraph(LightField field) {
    slabs_.push_back({SlabAxes{}, std::move(field)});
}

Lumigraph::Lumigraph(std::vector<Slab> slabs, const Box3d& box) : slabs_(std::move(slabs)), box_(box) {
    if (slabs_.empty() || slabs_.size() > kMostSlabs)
        throw InputError(fmt::format("a lamp of {} slabs; expected 1 to {}", slabs_.size(), kMostSlabs));
    for (const Slab& slab : slabs_) {
        if (const std::string fault = slab.axes.fault(); !fault.empty()) throw InputError("slab: " + fault);
        if (slab.field.info().unit != unit())
            throw InputError("slabs of one lamp in different units; expected all in W or all in lm");
    }
    if (simple()) return;
    if (!is_finite(box_.min) || !is_finite(box_.max) || box_.isEmpty() ||
        !(std::isfinite(box_.size().length2()) && box_.size().length2() > 0)) {
        throw InputError("an invalid box of the lamp; it must be finite and not empty");
    }
}

double Lumigraph::flux() const {
    double sum = 0;
    for (const Slab& slab : slabs_) sum += slab.field.flux();
    return sum;
}

bool Lumigraph::coloured() const {
    return std::any_of(slabs_.begin(), slabs_.end(), [this](const Slab& slab) {
        return slab.field.coloured() || slab.field.info().colour != slabs_[0].field.info().colour;
    });
}

V3d Lumigraph::xyz() const {
    if (slabs_.size() == 1) return slabs_[0].field.xyz();
    V3d sum(0, 0, 0);
    for (const Slab& slab : slabs_) sum += std::max(0.0, slab.field.flux()) * slab.field.xyz();
    return sum.y > 0 ? sum / sum.y : slabs_[0].field.xyz();
}

Rgb Lumigraph::colour() const {
    if (slabs_.size() == 1) return slabs_[0].field.info().colour;
    return colour_of_luminance_one(xyz_to_rgb(xyz()));
}

Lumigraph Lumigraph::channel(int c) const {
    std::vector<Slab> slabs;
    for (const Slab& slab : slabs_) slabs.push_back({slab.axes, slab.field.channel(c)});
    if (simple()) return Lumigraph(std::move(slabs[0].field));
    return {std::move(slabs), box_};
}

double Lumigraph::lumens_per_watt() const {
    double lumens = 0, watts = 0;
    for (const Slab& slab : slabs_) {
        const double flux = std::max(0.0, slab.field.flux()), efficacy = slab.field.info().lumens_per_watt;
        if (!(flux > 0)) continue;
        if (!(efficacy > 0)) return 0;
        lumens += flux * efficacy;
        watts += flux;
    }
    return watts > 0 ? lumens / watts : 0.0;
}

double Lumigraph::captured() const {
    double sum = 0;
    for (const Slab& slab : slabs_) sum += slab.field.info().captured;
    return sum;
}

double Lumigraph::missed() const {
    double sum = 0;
    for (const Slab& slab : slabs_) sum += slab.field.info().missed;
    return sum;
}

std::vector<const LightField*> fields_of(const Lumigraph& lamp) {
    std::vector<const LightField*> fields;
    for (const Slab& slab : lamp.slabs()) fields.push_back(&slab.field);
    return fields;
}

std::uint64_t content_hash(const Lumigraph& lamp) {
    if (lamp.simple()) return content_hash(lamp.slabs()[0].field);
    WordHash hash;
    const auto add = [&hash](const V3d& p) {
        for (int a = 0; a < 3; ++a) hash.add(p[a] == 0 ? 0.0 : p[a]);  // -0 hashes as 0
    };
    for (const Slab& slab : lamp.slabs()) {
        hash.add(content_hash(slab.field));
        add(slab.axes.u), add(slab.axes.v), add(slab.field.rig().centre);
    }
    add(lamp.box().min), add(lamp.box().max);
    return hash.value();
}

}  // namespace lucerna
