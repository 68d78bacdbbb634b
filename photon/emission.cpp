#include "photon/emission.h"

#include <algorithm>

namespace lucerna {

std::optional<Emission::Choice> Emission::choose(const EmissionNet::Point& point) const {
    if (!learned_) {
        const auto pick = scene_.picker().pick(point.light);
        if (!pick) return std::nullopt;
        return Choice{pick->light, 0, pick->probability, 1, point.u};
    }
    const auto pick = learned_->pick(point.light);
    if (!pick) return std::nullopt;
    Choice choice{pick->light, 0, pick->probability, 1, point.u};
    choice.scale = learned_->warp(choice.light, choice.u);
    return choice;
}

void Emission::start(std::uint32_t first, std::span<std::optional<LightPathStart>> out) {
    for (auto& start : out) start.reset();

    // Choose lights.
    choices_.clear();
    points_.resize(out.size());
    net_.points(first, points_);
    for (std::size_t i = 0; i < out.size(); ++i) {
        auto choice = choose(points_[i]);
        if (!choice) continue;
        choice->place = static_cast<std::uint32_t>(i);
        choices_.push_back(*choice);
    }

    // Sample each light once for all its paths.
    if (scene_.lights().size() > 1) sort_by_light();
    for (std::size_t from = 0; from < choices_.size();) {
        std::size_t to = from + 1;
        while (to < choices_.size() && choices_[to].light == choices_[from].light) ++to;
        emit_group(std::span(choices_).subspan(from, to - from), out);
        from = to;
    }
}

// Keeps the order of paths within each light.
void Emission::sort_by_light() {
    const std::size_t lights = scene_.lights().size();
    if (lights > kBatch) {
        std::stable_sort(choices_.begin(), choices_.end(),
                         [](const Choice& a, const Choice& b) { return a.light < b.light; });
        return;
    }
    // Counting sort avoids comparisons of randomly drawn lights, which branch predictors cannot foresee.
    begins_.assign(lights + 1, 0);
    for (const Choice& choice : choices_) ++begins_[choice.light + 1];
    for (std::size_t light = 1; light < lights; ++light) begins_[light + 1] += begins_[light];
    sorted_.resize(choices_.size());
    for (const Choice& choice : choices_) sorted_[begins_[choice.light]++] = choice;
    choices_.swap(sorted_);
}

void Emission::emit_group(std::span<const Choice> group, std::span<std::optional<LightPathStart>> out) {
    numbers_.clear();
    for (const Choice& choice : group) numbers_.push_back(choice.u);
    emitted_.resize(group.size());
    const std::uint32_t light = group.front().light;
    scene_.lights()[light]->sample_Le_many(numbers_, emitted_);
    const std::int32_t medium = scene_.medium_of_light(light);
    const Rgb& reach = scene_.reach_of_light(light);  // 1; 0 for a light at infinity if a medium is unbounded
    for (std::size_t i = 0; i < group.size(); ++i) {
        const std::optional<LeSample>& emitted = emitted_[i];
        if (!emitted) continue;
        const Rgb weight = emitted->weight * reach;
        if (is_black(weight)) continue;
        out[group[i].place] = LightPathStart{light, emitted->cell, emitted->from, emitted->d,
                                             // The probability of a picked light is > 0.
                                             weight / group[i].probability * group[i].scale, medium};
    }
}

}  // namespace lucerna
