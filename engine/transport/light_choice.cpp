#include "engine/transport/light_choice.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace lucerna {
namespace {

// Returns the densities of a light without parts, for which they are equal.
PartPdf whole(float pdf_w) {
    return {kNoCell, pdf_w, pdf_w};
}

}  // namespace

const Guide::Choice& Guide::draw(float u) const {
    assert(!empty());
    const auto found = std::upper_bound(choices_.begin(), choices_.end() - 1, u,
                                        [](float wanted, const Choice& c) { return wanted < c.upto; });
    return *found;
}

float Guide::probability(std::uint32_t light, CellId part) const {
    const std::uint64_t wanted_key = key(light, part);
    const auto found = std::lower_bound(
        choices_.begin(), choices_.end(), wanted_key,
        [](const Choice& choice, std::uint64_t wanted) { return key(choice.light, choice.part) < wanted; });
    return found != choices_.end() && found->light == light && found->part == part ? found->probability
                                                                                   : 0.0F;
}

bool nothing_to_choose(const Scene& scene) {
    const auto asked = std::count_if(scene.lights().begin(), scene.lights().end(), [](const auto& light) {
        return !light->only_particles() && light->power() > 0;
    });
    return asked <= 1 && !has_parts(scene);
}

bool has_parts(const Scene& scene) {
    // A light that has parts has a first cell, and that cell belongs to a part.
    return std::any_of(scene.lights().begin(), scene.lights().end(),
                       [](const auto& light) { return light->part_of(0) != kNoCell; });
}

std::optional<LightChoice::Plain> LightChoice::pick_plainly(const Scene& scene, float u) const {
    if (tree_) {
        const auto pick = tree_->pick(x_, n_, u);
        return pick ? std::optional(Plain{pick->light, pick->part, pick->probability}) : std::nullopt;
    }
    const auto pick = scene.picker().pick(u);
    return pick ? std::optional(Plain{pick->light, kNoCell, pick->probability}) : std::nullopt;
}

float LightChoice::plain_density(const Scene& scene, std::uint32_t light, const PartPdf& pdf,
                                 const std::optional<Plain>& plain) const {
    if (!tree_) {
        const float probability = plain ? plain->probability : scene.picker().probability(light);
        return probability * pdf.whole_pdf_w;
    }
    const float probability = plain ? plain->probability : tree_->probability(x_, n_, light, pdf.part);
    return probability * (tree_->picks_parts_of(light) ? pdf.part_pdf_w : pdf.whole_pdf_w);
}

float LightChoice::mixture(float plain, std::uint32_t light, const PartPdf& pdf) const {
    float density = defensive_weight_ * plain;
    if (defensive_weight_ < 1)
        density += (1 - defensive_weight_) * guide_.probability(light, pdf.part) * pdf.part_pdf_w;
    return density;
}

std::optional<LightChoice::Draw> LightChoice::draw(const Scene& scene, const V3f& x, float u_light,
                                                   const V2f& u_place) const {
    Draw draw{};
    std::optional<CellId> part;
    std::optional<Plain> plain;
    if (u_light < defensive_weight_) {  // always true without a guide, where defensive_weight_ is 1
        plain = pick_plainly(scene, std::min(u_light / defensive_weight_, kBelowOne));
        if (!plain) return std::nullopt;
        draw.light = plain->light;
        if (plain->part != kNoCell) part = plain->part;
    } else {
        const Guide::Choice& choice =
            guide_.draw(std::min((u_light - defensive_weight_) / (1 - defensive_weight_), kBelowOne));
        draw.light = choice.light;
        if (choice.part != kNoCell) part = choice.part;
    }
    const Light& light = *scene.lights()[draw.light];
    const auto light_sample = light.sample_Li(x, u_place, part);
    if (!light_sample) return std::nullopt;

    // A drawn sample has a density above 0, unless it underflows in float32. The sample is then discarded.
    const bool delta = light.is_delta();
    const PartPdf pdf = delta ? whole(1) : light_sample->part.value_or(whole(light_sample->pdf_w));
    const float density = mixture(plain_density(scene, draw.light, pdf, plain), draw.light, pdf);
    if (!(density > 0) || !std::isfinite(density)) return std::nullopt;
    draw.light_sample = *light_sample;
    draw.gain = (delta ? 1 : light_sample->pdf_w) / density;
    draw.pdf_w = delta ? 0 : density;
    return draw;
}

float LightChoice::pdf_w(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const {
    const PartPdf pdf = seen.part.value_or(whole(seen.pdf_w));
    return mixture(plain_density(scene, light, pdf, std::nullopt), light, pdf);
}

}  // namespace lucerna
