#include "engine/render/small_lamps.h"

#include <algorithm>
#include <cmath>

#include "engine/base/cdf.h"
#include "engine/scene/media_traversal.h"

namespace lucerna {
namespace {

// Distance by which rounding may move a lamp on the film, pixels.
constexpr float kSlack = 0.01F;

// Least share of a lamp's importance that counts where its bounds lie at the edge of the filter, because
// bounds are wider than lamps.
constexpr float kLeastShare = 0.1F;

// Returns the length of the intersection of two intervals.
float overlap(float a_begin, float a_end, float b_begin, float b_end) {
    return std::max(0.0F, std::min(a_end, b_end) - std::max(a_begin, b_begin));
}

V2f centre_of(const V2i& pixel) {
    return {static_cast<float>(pixel.x) + 0.5F, static_cast<float>(pixel.y) + 0.5F};
}

}  // namespace

SmallLamps::SmallLamps(const Job& job)
    : job_(job), filter_(job.film.filter), set_(job.scene.lights().size()) {
    if (quantity_of(job.integrator) != Quantity::radiance) return;
    for (std::uint32_t light = 0; light < job.scene.lights().size(); ++light) take(light);
    if (!lamps_.empty()) sort_by_pixel(touches());
}

void SmallLamps::take(std::uint32_t light) {
    const Light& asked = *job_.scene.lights()[light];
    if (!job_.scene.is_on_solid_surfaces(light) || asked.is_delta() || asked.only_particles() ||
        asked.has_impostor())
        return;
    auto whole = asked.bounds();
    if (!whole) return;
    whole->power = static_cast<float>(asked.power());
    if (take(light, std::nullopt, *whole)) return set_.add(light);
    const auto parts = asked.part_bounds();
    for (CellId part = 0; part < parts.size(); ++part) {
        LightBounds bounds = parts[part];
        bounds.power *= whole->power;
        if (take(light, part, bounds)) set_.add(light, part);
    }
}

bool SmallLamps::take(std::uint32_t light, std::optional<CellId> part, const LightBounds& bounds) {
    const auto on_film = job_.camera.bounds_on_film(bounds.box);
    if (!on_film || !(std::max(on_film->size().x, on_film->size().y) <= kLargest)) return false;
    const float importance = LightImportance(bounds).at(job_.camera.lens_point(V2f(0.5F)), V3f(0, 0, 0));
    if (!(importance > 0) || !std::isfinite(importance)) return false;
    const View view = view_of(job_);
    const V2f reach = filter_.radius() + V2f(kSlack);
    const bool in_view = on_film->max.x > view.begin.x - reach.x && on_film->min.x < view.end.x + reach.x &&
                         on_film->max.y > view.begin.y - reach.y && on_film->min.y < view.end.y + reach.y;
    if (in_view) lamps_.push_back({light, part, *on_film, importance});
    return in_view;
}

std::vector<SmallLamps::Touch> SmallLamps::touches() const {
    const V2i first = job_.film.crop_begin, last = first + job_.film.rendered_size() - V2i(1);
    const V2f radius = filter_.radius();
    // Finds the pixels on one axis whose centre lies within the radius of the bounds.
    const auto from = [](float bound, float reach) {
        return static_cast<int>(std::ceil(bound - reach - 0.5F - kSlack));
    };
    const auto to = [](float bound, float reach) {
        return static_cast<int>(std::floor(bound + reach - 0.5F + kSlack));
    };
    std::vector<Touch> touches;
    for (std::uint32_t i = 0; i < lamps_.size(); ++i) {
        const Box2f& box = lamps_[i].on_film;
        const V2f size(std::max(box.size().x, kSlack), std::max(box.size().y, kSlack));
        const float area = size.x * size.y;  // >= kSlack²
        for (int y = std::max(first.y, from(box.min.y, radius.y));
             y <= std::min(last.y, to(box.max.y, radius.y)); ++y) {
            for (int x = std::max(first.x, from(box.min.x, radius.x));
                 x <= std::min(last.x, to(box.max.x, radius.x)); ++x) {
                const V2f begin = centre_of({x, y}) - radius, end = centre_of({x, y}) + radius;
                const float within = overlap(box.min.x, box.min.x + size.x, begin.x, end.x) *
                                     overlap(box.min.y, box.min.y + size.y, begin.y, end.y) / area;
                touches.push_back({{x, y}, i, lamps_[i].importance * std::max(within, kLeastShare)});
            }
        }
    }
    std::ranges::stable_sort(touches, [](const Touch& a, const Touch& b) {
        return a.pixel.y != b.pixel.y ? a.pixel.y < b.pixel.y : a.pixel.x < b.pixel.x;
    });
    return touches;
}

void SmallLamps::sort_by_pixel(const std::vector<Touch>& touches) {
    const int first_row = job_.film.crop_begin.y;
    std::vector<double> importances;
    for (std::size_t i = 0; i < touches.size();) {
        const V2i at = touches[i].pixel;
        rows_.resize(static_cast<std::size_t>(at.y - first_row) + 1,
                     static_cast<std::uint32_t>(pixels_.size()));
        Pixel pixel{at.x, static_cast<std::uint32_t>(touched_.size())};
        importances.clear();
        for (; i < touches.size() && touches[i].pixel == at; ++i) {
            touched_.push_back(touches[i].lamp);
            importances.push_back(double{touches[i].importance});
        }
        if (importances.size() > kMostAsked) {
            pixel.cdf = static_cast<std::int32_t>(cdfs_.size());
            cdfs_.emplace_back(importances);
        }
        pixels_.push_back(pixel);
    }
    rows_.resize(static_cast<std::size_t>(job_.film.rendered_size().y) + 1,
                 static_cast<std::uint32_t>(pixels_.size()));
    pixels_.push_back({0, static_cast<std::uint32_t>(touched_.size())});
}

SmallLamps::InReach SmallLamps::in_reach(const V2i& pixel) const {
    if (touched_.empty()) return {};
    const auto row = static_cast<std::size_t>(pixel.y - job_.film.crop_begin.y);
    const auto begin = pixels_.begin() + rows_[row], end = pixels_.begin() + rows_[row + 1];
    const auto found = std::lower_bound(begin, end, pixel.x, [](const Pixel& a, int x) { return a.x < x; });
    if (found == end || found->x != pixel.x) return {};
    const Cdf* const cdf = found->cdf < 0 ? nullptr : &cdfs_[static_cast<std::size_t>(found->cdf)];
    return {found->begin, (found + 1)->begin, cdf};
}

void SmallLamps::add(const InReach& lamps, const V2i& pixel, Sampler& sampler,
                     const PathAccount& path) const {
    const int asked = lamps.by_power ? kMostAsked : static_cast<int>(lamps.end - lamps.begin);
    for (int i = 0; i < asked; ++i) {
        std::size_t chosen = static_cast<std::size_t>(i);
        float expected = 1;  // expected number of samples of this lamp per camera sample
        if (lamps.by_power) {
            const float u = (static_cast<float>(i) + sampler.next()) / static_cast<float>(asked);
            const Cdf::Draw draw = lamps.by_power->draw(std::min(u, kBelowOne));
            chosen = draw.item;
            expected = static_cast<float>(asked * draw.probability);  // > 0
        }
        const Lamp& lamp = lamps_[touched_[lamps.begin + chosen]];
        path.add_emitted(draw(lamp, expected, pixel, sampler, static_cast<std::uint32_t>(i)), lamp.light);
    }
}

// Samples one lamp from one point of the lens. The divisors are `expected`, which is positive; in sample_Li()
// the density of the direction, where the distance of the lens is at least that of the lamp's box, which is
// at least the box's diagonal; and in project() the cosine to the film plane, positive for the same reason.
Rgb SmallLamps::draw(const Lamp& lamp, float expected, const V2i& pixel, Sampler& sampler,
                     std::uint32_t branch) const {
    const V2f u_lens = sampler.next2(), u_place = sampler.next2();
    const V3f lens = job_.camera.lens_point(u_lens);
    const auto from_lamp = job_.scene.lights()[lamp.light]->sample_Li(lens, u_place, lamp.part);
    if (!from_lamp || !(from_lamp->pdf_w > 0)) return Rgb(0);
    const auto seen = job_.camera.project(u_lens, from_lamp->w);
    if (!seen) return Rgb(0);
    const float filter = filter_.value(seen->film - centre_of(pixel));
    if (filter == 0) return Rgb(0);
    // Visibility is tested by closest hits, as for a camera ray, since cut-outs may treat shadow rays
    // differently.
    const Ray ray{lens, from_lamp->w, from_lamp->distance};
    Sampler more = sampler.split(branch);
    return from_lamp->weight * (filter * seen->pixels2_per_sr / expected) *
           passing(job_.scene, ray, job_.camera_medium.value_or(job_.scene.media().camera), more, false);
}

}  // namespace lucerna
