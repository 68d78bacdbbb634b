// Tiles on the ranks of a parallel job: every tile's sums are on one rank, the one that renders its next
// samples. Rank 0 knows where each is, and hands them out anew in every round (engine/ranks/ranks.h): a rank
// keeps its tiles, and one that has nothing left to do takes over those of another, with their sums. For a
// whole image they are brought together at rank 0.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/ranks/ranks.h"
#include "engine/render/allocation.h"
#include "engine/render/film.h"
#include "engine/render/layer_films.h"
#include "engine/render/tiles.h"

namespace lucerna {

// What a tile has: of its pixels' samples all numbers below; of the first ones, steps
// (TileRenderer::render_first).
struct TileState {
    std::int32_t samples = 0;
    std::int32_t first_steps = 0;
};

// Calls are collective.
class TileExchange {
  public:
    // What is referred to is this rank's own; `parts` and `allocation` may be null. Rank 0 has the sums of
    // all tiles that have samples.
    TileExchange(Ranks& ranks, const Scene& scene, const TileRenderer& tiles, Film& film, LayerFilms* parts,
                 SampleAllocation* allocation, std::span<TileState> states);

    // As Ranks::work(), of tiles: `loop` without what moves their state. At rank 0: what the others did.
    template <typename Render>
    std::vector<std::int64_t> render(const Workers& workers, Ranks::Loop loop, Render&& render);

    // Rank 0's film, and parts, and allocation, have the sums of all tiles; and the counts.
    void bring_together();
    // SampleAllocation::decide(done), on what all ranks saw.
    void decide(int done);
    // All ranks allocate as rank 0.
    void share_allocation();

    // What all ranks have counted so far; at rank 0 the next three tell.
    void count();
    const BadSamples& bad_samples() const { return bad_; }
    std::uint64_t rays() const { return rays_; }
    std::uint64_t invalid_rays() const { return invalid_rays_; }

    // Tiles by this rank, rounds counted apart.
    std::uint64_t rendered() const { return rendered_; }

  private:
    std::vector<std::int64_t> finish_round(const std::vector<std::int64_t>& own);
    template <typename Archive>
    void fields_of(std::int64_t tile, Archive& archive);
    auto fields() {
        return [this](std::int64_t tile, auto& archive) { fields_of(tile, archive); };
    }
    template <typename Visit>
    void for_each_block(std::int64_t tile, Visit&& visit) const;

    Ranks& ranks_;
    const Scene& scene_;
    const TileRenderer& tiles_;
    Film& film_;
    LayerFilms* parts_;
    SampleAllocation* allocation_;
    std::span<TileState> states_;
    ItemStates tiles_on_ranks_;
    BadSamples bad_;
    std::uint64_t rays_ = 0, invalid_rays_ = 0;
    std::uint64_t rendered_ = 0;
};

template <typename Render>
std::vector<std::int64_t> TileExchange::render(const Workers& workers, Ranks::Loop loop, Render&& render) {
    const std::vector<std::int64_t> own =
        tiles_on_ranks_.work(workers, std::move(loop), fields(),
                             [&](std::int64_t tile) { render(static_cast<std::size_t>(tile)); });
    rendered_ += own.size();
    return finish_round(own);
}

}  // namespace lucerna
