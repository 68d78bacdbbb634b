#include "engine/scene/bsdf.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/warp.h"
#include "engine/scene/lobe_models.h"

namespace lucerna {
namespace {

// Returns the frame about ns whose s lies along dpdu, or an arbitrary one if dpdu is parallel to ns.
Frame frame_along(const V3f& ns, const V3f& dpdu) {
    const V3f across = dpdu - ns.dot(dpdu) * ns;
    const float length = across.length();
    if (!(length > 1e-6F * dpdu.length() && std::isfinite(length))) return Frame(ns);
    Frame frame;
    frame.n = ns;
    frame.s = across / length;
    frame.t = ns.cross(frame.s);
    return frame;
}

V3f to_local(const Frame& frame, const V3f& w, float side) {
    const V3f v = frame.to_local(w);
    return {v.x, v.y, side * v.z};
}

// Returns +1 outside, -1 inside; a direction within the surface counts as outside.
float side_of(const V3f& ng, const V3f& wo) {
    return ng.dot(wo) >= 0 ? 1.0F : -1.0F;
}

bool is_delta_of(const Lobe& lobe) {
    return std::visit([](const auto& l) { return is_delta_lobe(l); }, lobe);
}
// Tells whether the lobe reflects without any peak.
bool is_diffuse_lobe(const Lobe& lobe) {
    return std::holds_alternative<DiffuseLobe>(lobe) || std::holds_alternative<OrenNayarLobe>(lobe) ||
           std::holds_alternative<CoveredDiffuseLobe>(lobe) ||
           std::holds_alternative<SubstrateBaseLobe>(lobe);
}
bool transmits_lobe(const Lobe& lobe) {
    return std::holds_alternative<DielectricLobe>(lobe) ||
           std::holds_alternative<DiffuseTransmitLobe>(lobe) ||
           std::holds_alternative<ThinDielectricLobe>(lobe);
}
// Returns GGX's larger alpha, 0 for a delta lobe, infinity for a lobe without a peak.
float blur_of(const Lobe& lobe) {
    if (is_delta_of(lobe)) return 0;
    return std::visit(
        [](const auto& l) -> float {
            if constexpr (requires { l.alpha_x; }) return std::max(l.alpha_x, l.alpha_y);
            return INFINITY;
        },
        lobe);
}
bool is_black_lobe(const Lobe& lobe) {
    return std::holds_alternative<BlackLobe>(lobe);
}
// Returns the lobe restricted to reflection or to transmission.
Lobe one_side_of(const Lobe& lobe, bool transmission) {
    if (const auto* glass = std::get_if<DielectricLobe>(&lobe)) {
        DielectricLobe half = *glass;
        (transmission ? half.reflect : half.transmit) = Rgb(0.0F);
        return half;
    }
    return std::holds_alternative<DiffuseTransmitLobe>(lobe) == transmission ? lobe : Lobe(BlackLobe{});
}
[[maybe_unused]] bool is_sound_lobe(const Lobe& lobe) {
    return std::visit([](const auto& l) { return is_sound(l); }, lobe);
}

// Lobes are drawn with probabilities in proportion to their guessed albedos, all 0 where no lobe scatters.
using Chances = std::array<float, Bsdf::kMaxLobes>;
Chances chances_of(std::span<const Lobe> lobes, const Local& at) {
    Chances chances{};
    float sum = 0;
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        chances[i] = std::visit([&](const auto& lobe) { return chance_of(lobe, at); }, lobes[i]);
        sum += chances[i];
    }
    if (!(sum > 0)) return chances;
    for (std::size_t i = 0; i < lobes.size(); ++i) chances[i] /= sum;
    return chances;
}

Rgb value_of(std::span<const Lobe> lobes, const Local& at, Transport transport) {
    Rgb sum(0.0F);
    for (const Lobe& lobe : lobes) {
        sum += std::visit([&](const auto& l) { return value(l, at, transport); }, lobe);
    }
    return sum;
}

float density_of(std::span<const Lobe> lobes, const Chances& chances, const Local& at) {
    float sum = 0;
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        if (!(chances[i] > 0)) continue;
        sum += chances[i] * std::visit([&](const auto& lobe) { return density(lobe, at); }, lobes[i]);
    }
    return sum;
}

Draw draw_of(const Lobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    return std::visit([&](const auto& l) { return draw(l, at, u, transport); }, lobe);
}

// Draws from one of several lobes: the first number of `u` chooses the lobe and is rescaled for its use.
Draw draw_one(std::span<const Lobe> lobes, const Local& at, BsdfU u, Transport transport) {
    const Chances chances = chances_of(lobes, at);
    std::size_t chosen = lobes.size();  // finally the last lobe that can be drawn, if u exceeds all sums
    float before = 0, upto = 0;
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        if (!(chances[i] > 0)) continue;
        if (chosen < lobes.size() && u.lobe < upto) break;
        chosen = i;
        before = upto;
        upto += chances[i];
    }
    if (chosen == lobes.size()) return std::nullopt;
    u.lobe = std::clamp((u.lobe - before) / chances[chosen], 0.0F, 1 - 0x1p-24F);
    Draw drawn = draw_of(lobes[chosen], at, u, transport);
    if (!drawn) return std::nullopt;
    if (drawn->delta) {
        drawn->weight /= chances[chosen];
        return drawn;
    }
    // Any lobe may have drawn this direction, so the weight is the sum of all values over the density of all.
    Local to = at;
    to.wi = drawn->wi;
    to.transmission = drawn->transmission;
    drawn->pdf_w = density_of(lobes, chances, to);
    if (!(drawn->pdf_w > 0)) return std::nullopt;
    drawn->weight = value_of(lobes, to, transport) * (std::fabs(to.wi.z) / drawn->pdf_w);
    return drawn;
}

}  // namespace

Bsdf::Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu)
    : frame_(frame_along(ns, dpdu)), ng_(ng) {
    lobes_[0] = lobe;
    diffuse_ = is_diffuse_lobe(lobe) ? 1 : 0;
    assert(is_sound_lobe(lobe));
}

Bsdf::Bsdf(const DiffuseLobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu)
    : diffuse_(1), frame_(frame_along(ns, dpdu)), ng_(ng) {
    assert(is_sound(lobe));
    lobes_[0] = lobe;
}

Bsdf::Bsdf(std::span<const Lobe> lobes, const V3f& ns, const V3f& ng, const V3f& dpdu)
    : count_(0), frame_(frame_along(ns, dpdu)), ng_(ng) {
    assert(lobes.size() <= kMaxLobes);
    DiffuseLobe diffuse{Rgb(0.0F)};
    bool any_diffuse = false;
    for (const Lobe& lobe : lobes) {
        assert(is_sound_lobe(lobe));
        if (const auto* d = std::get_if<DiffuseLobe>(&lobe)) {
            diffuse.albedo += d->albedo;
            any_diffuse = true;
        }
    }
    if (any_diffuse) lobes_[count_++] = diffuse;
    for (const bool first : {true, false}) {
        for (const Lobe& lobe : lobes) {
            if (is_black_lobe(lobe) || std::holds_alternative<DiffuseLobe>(lobe)) continue;
            if (is_diffuse_lobe(lobe) == first) lobes_[count_++] = lobe;
        }
        if (first) diffuse_ = count_;
    }
    count_ = std::max<std::size_t>(count_, 1);  // lobes_ begins as black
}

Rgb Bsdf::f(const V3f& wo, const V3f& wi, Transport transport) const {
    const float side = side_of(ng_, wo);
    const float cos_g = side * ng_.dot(wi);
    if (cos_g == 0) return Rgb(0.0F);  // within the surface, on neither side
    const Local at{to_local(frame_, wo, side), to_local(frame_, wi, side), side > 0, cos_g < 0};
    return value_of(lobes(), at, transport);
}

float Bsdf::pdf_w(const V3f& wo, const V3f& wi) const {
    const float side = side_of(ng_, wo);
    const float cos_g = side * ng_.dot(wi);
    if (cos_g == 0) return 0;
    const Local at{to_local(frame_, wo, side), to_local(frame_, wi, side), side > 0, cos_g < 0};
    if (count_ == 1) return std::visit([&](const auto& lobe) { return density(lobe, at); }, lobes_[0]);
    return density_of(lobes(), chances_of(lobes(), at), at);
}

std::optional<BsdfSample> Bsdf::sample(const V3f& wo, const BsdfU& u, Transport transport) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    if (is_lambertian()) {  // the most frequent case, without virtual dispatch over lobes
        const V3f w = square_to_cosine_hemisphere(u.direction);
        if (!(w.z > 0) || (transport == Transport::particles && at.wo.z < 0)) return std::nullopt;
        const V3f wi = unit(frame_.to_world({w.x, w.y, side * w.z}));
        if (!(side * ng_.dot(wi) > 0)) return std::nullopt;  // below the geometric horizon
        return BsdfSample{wi, std::get_if<DiffuseLobe>(&lobes_[0])->albedo, cosine_hemisphere_pdf_w(w.z),
                          false, false};
    }
    const Draw drawn =
        count_ == 1 ? draw_of(lobes_[0], at, u, transport) : draw_one(lobes(), at, u, transport);
    if (!drawn) return std::nullopt;
    BsdfSample sample{-wo,
                      drawn->weight,
                      drawn->pdf_w,
                      drawn->delta,
                      drawn->transmission,
                      drawn->eta_scale,
                      drawn->straight};
    if (drawn->straight) return sample;  // exact, even for a direction along the surface
    sample.wi = unit(frame_.to_world({drawn->wi.x, drawn->wi.y, side * drawn->wi.z}));
    // Both normals must agree on the side, or light would leak.
    const float cos_g = side * ng_.dot(sample.wi);
    if (cos_g == 0 || sample.transmission != (cos_g < 0)) return std::nullopt;
    return sample;
}

Rgb Bsdf::albedo(const V3f& wo) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    if (count_ == 1) return std::visit([&](const auto& lobe) { return albedo_of(lobe, at); }, lobes_[0]);
    Rgb sum(0.0F);
    for (const Lobe& lobe : lobes()) {
        sum += std::visit([&](const auto& l) { return albedo_of(l, at); }, lobe);
    }
    return at_most_one(sum);
}

std::optional<float> Bsdf::reflect_chance(const V3f& wo) const {
    if (count_ != 1) return std::nullopt;
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    if (const auto* boundary = std::get_if<DielectricLobe>(&lobes_[0]))
        return reflect_chance_of(*boundary, at);
    if (const auto* pane = std::get_if<ThinDielectricLobe>(&lobes_[0])) return reflect_chance_of(*pane, at);
    return std::nullopt;
}

Rgb Bsdf::straight_share(const V3f& wo) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    Rgb sum(0.0F);
    for (const Lobe& lobe : lobes()) {
        if (const auto* boundary = std::get_if<DielectricLobe>(&lobe))
            sum += straight_share_of(*boundary, at);
        if (const auto* pane = std::get_if<ThinDielectricLobe>(&lobe)) sum += straight_share_of(*pane, at);
    }
    return sum;
}

float Bsdf::guessed_albedo(const V3f& wo) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    float sum = 0;
    for (const Lobe& lobe : lobes()) {
        sum += std::visit([&](const auto& l) { return chance_of(l, at); }, lobe);
    }
    return sum;
}

Bsdf::SidedAlbedo Bsdf::blurred_albedo(const V3f& wo) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    SidedAlbedo sum;
    for (const Lobe& lobe : lobes()) {
        if (is_delta_of(lobe)) continue;
        for (const bool transmission : {false, true}) {
            const Lobe half = one_side_of(lobe, transmission);
            Rgb& to = transmission ? sum.transmitted : sum.reflected;
            to += std::visit([&](const auto& l) { return albedo_of(l, at); }, half);
        }
    }
    for (int c = 0; c < 3; ++c) {
        sum.reflected[c] = std::min(sum.reflected[c], 1.0F);
        sum.transmitted[c] = std::min(sum.transmitted[c], 1.0F);
    }
    return sum;
}

bool Bsdf::is_delta() const {
    return std::all_of(lobes().begin(), lobes().end(), is_delta_of);
}

bool Bsdf::transmits() const {
    return std::any_of(lobes().begin(), lobes().end(), transmits_lobe);
}

Bsdf Bsdf::part(std::size_t begin, std::size_t end) const {
    Bsdf part(frame_, ng_);
    std::copy(lobes_.begin() + static_cast<std::ptrdiff_t>(begin),
              lobes_.begin() + static_cast<std::ptrdiff_t>(end), part.lobes_.begin());
    part.count_ = std::max<std::size_t>(end - begin, 1);  // lobes_ begins as black
    part.diffuse_ = std::min(std::max(diffuse_, begin) - begin, end - begin);
    return part;
}

Bsdf Bsdf::part_by_sharpness(float below, bool sharp) const {
    Bsdf part(frame_, ng_);
    part.count_ = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const float blur = blur_of(lobes_[i]);
        if ((blur == 0 || blur < below) != sharp) continue;
        part.lobes_[part.count_++] = lobes_[i];
        if (i < diffuse_) part.diffuse_ = part.count_;
    }
    part.count_ = std::max<std::size_t>(part.count_, 1);  // lobes_ begins as black
    return part;
}

Bsdf Bsdf::sharp_part(float below) const {
    return part_by_sharpness(below, true);
}

Bsdf Bsdf::blurred_part(float below) const {
    return part_by_sharpness(below, false);
}

Bsdf Bsdf::diffuse_part() const {
    return part(0, diffuse_);
}

Bsdf Bsdf::rest() const {
    return part(diffuse_, count_);
}

}  // namespace lucerna
