#include "engine/cli/render/checkpointing.h"

#include <fmt/format.h>

#include <vector>

#include "engine/base/error.h"
#include "engine/cli/run.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

std::string film_text(const FilmSettings& film) {
    const FilterSettings& f = film.filter;
    return fmt::format("{} x {} pixels from ({}, {}) to ({}, {}), scale {}, filter {} {} {} {} {} {} {}",
                       film.width, film.height, film.crop_begin.x, film.crop_begin.y, film.crop_end.x,
                       film.crop_end.y, film.scale, static_cast<int>(f.kind), f.radius.x, f.radius.y, f.sigma,
                       f.b, f.c, f.tau);
}

Facts facts_of(const Job& job, const FilmSettings& film, std::uint64_t seed) {
    const V2i size = film.rendered_size();
    Facts facts = scene_facts(job);
    const Facts of_picture{
        {"view (hash of camera, film and calculation surfaces)", fmt::format("{:016x}", job.view.hash())},
        {"image size", fmt::format("{} x {}", size.x, size.y)},
        {std::string(kHalvesFact), film.adaptive     ? "two halves, adaptive"
                                   : film.two_halves ? "two halves"
                                                     : std::string(kNoLayers)},
        {std::string(kPartsFact), film.parts ? "by kind and by light group" : std::string(kNoLayers)},
        {"film", film_text(film)},
        {"integrator", std::string(integrator_name(job.integrator))},
        {"seed", fmt::format("{}", seed)}};
    facts.insert(facts.end(), of_picture.begin(), of_picture.end());
    for (auto& [name, value] : describe(job.integrator)) facts.emplace_back("parameter " + name, value);
    return facts;
}

}  // namespace

Facts picture_facts(const Job& job, std::uint64_t seed) {
    return facts_of(job, job.film, seed);
}

Facts whole_picture_facts(const Job& job, std::uint64_t seed) {
    FilmSettings whole = job.film;
    whole.crop_begin = whole.view_begin, whole.crop_end = whole.view_end;
    return facts_of(job, whole, seed);
}

Checkpointing::Checkpointing(const CheckpointOptions& options, Monitor& monitor)
    : options_(options), monitor_(monitor) {
    if (options.resume.empty()) return;
    std::error_code status;
    if (!options.save.empty() && same_file(options.resume, options.save) &&
        !std::filesystem::exists(options.resume, status)) {
        monitor.info(fmt::format("no checkpoint {} yet: the render starts from the beginning",
                                 options.resume.string()));
        return;
    }
    resumed_ = load_checkpoint(options.resume);
}

void Checkpointing::attach(const Job& job, RenderOptions& render) {
    if (options_.kept().empty()) return;
    facts_ = picture_facts(job, render.seed);
    if (resumed_) {
        require_same(options_.resume, resumed_->facts, facts_);
        render.resume = &*resumed_;
    }
    render.keep_every = options_.every;
    render.keep = [this](Checkpoint checkpoint) { keep(std::move(checkpoint)); };
}

// Remembers a failure and goes on, because a full disk may have room later and the image is worth more than
// its checkpoint.
void Checkpointing::keep(Checkpoint checkpoint) {
    checkpoint.facts = facts_;
    try {
        save_checkpoint(options_.kept(), checkpoint);
        failed_ = nullptr;
    } catch (const InputError& error) {
        failed_ = std::current_exception();
        monitor_.warn(fmt::format("{}; the render continues, the previous checkpoint is kept", error.what()));
    }
}

void Checkpointing::finish() const {
    if (failed_) std::rethrow_exception(failed_);
}

}  // namespace lucerna
