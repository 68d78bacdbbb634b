#include "photon/emission.h"

#include <algorithm>

namespace lucerna {

void Emission::start(std::uint32_t first, std::span<std::optional<LightPathStart>> out) {
    std::fill(out.begin(), out.end(), std::nullopt);

    // Choose lights.
    choices_.clear();
    for (std::size_t i = 0; i < out.size(); ++i) {
        const EmitNet::Point point = net_.at(first + static_cast<std::uint32_t>(i));
        const auto pick = scene_.picker().pick(point.light);
        if (pick)
            choices_.push_back({pick->light, static_cast<std::uint32_t>(i), pick->probability, point.u});
    }

    // Ask each of them once.
    const auto by_light = [](const Choice& a, const Choice& b) {
        return a.light != b.light ? a.light < b.light : a.place < b.place;
    };
    if (scene_.lights().size() > 1) std::sort(choices_.begin(), choices_.end(), by_light);
    for (std::size_t from = 0; from < choices_.size();) {
        std::size_t to = from + 1;
        while (to < choices_.size() && choices_[to].light == choices_[from].light) ++to;
        emit_group(std::span(choices_).subspan(from, to - from), out);
        from = to;
    }
}

void Emission::emit_group(std::span<const Choice> group, std::span<std::optional<LightPathStart>> out) {
    numbers_.clear();
    for (const Choice& choice : group) numbers_.push_back(choice.u);
    emitted_.resize(group.size());
    const std::uint32_t light = group.front().light;
    scene_.lights()[light]->emit_many(numbers_, emitted_);
    const std::int32_t medium = scene_.medium_of_light(light);
    const Rgb& reach = scene_.reach_of_light(light);
    for (std::size_t i = 0; i < group.size(); ++i) {
        const std::optional<Emitted>& emitted = emitted_[i];
        if (!emitted) continue;
        const Rgb weight = emitted->weight * reach;
        if (is_black(weight)) continue;
        out[group[i].place] =
            LightPathStart{light,
                           emitted->cell,
                           emitted->from,
                           emitted->d,
                           weight / group[i].probability,  // a picked light has probability > 0
                           medium};
    }
}

}  // namespace lucerna
