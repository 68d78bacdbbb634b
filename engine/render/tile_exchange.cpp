#include "engine/render/tile_exchange.h"

namespace lucerna {

TileExchange::TileExchange(Ranks& ranks, const Scene& scene, const TileRenderer& tiles, Film& film,
                           LayerFilms* parts, SampleAllocation* allocation, std::span<TileState> states)
    : ranks_(ranks),
      scene_(scene),
      tiles_(tiles),
      film_(film),
      parts_(parts),
      allocation_(allocation),
      states_(states),
      tiles_on_ranks_(states.size()) {
    for (std::size_t t = 0; ranks.leads() && t < states.size(); ++t) {
        if (states[t].samples > 0) tiles_on_ranks_.begin_at_rank_0(ranks, t);
    }
    bad_ = tiles.bad_samples();
}

template <typename Visit>
void TileExchange::for_each_block(std::int64_t tile, Visit&& visit) const {
    constexpr int kSide = SampleAllocation::kBlock;
    const PixelBox box = tiles_.box(static_cast<int>(tile));
    for (int y = box.begin.y; y < box.end.y; y += kSide) {
        for (int x = box.begin.x; x < box.end.x; x += kSide) visit(allocation_->block_of({x, y}));
    }
}

template <typename Archive>
void TileExchange::fields_of(std::int64_t tile, Archive& archive) {
    const PixelBox box = tiles_.box(static_cast<int>(tile));
    archive(states_[static_cast<std::size_t>(tile)]);
    film_.fields_of(box.begin, box.end, archive);
    if (parts_) parts_->fields_of(box.begin, box.end, archive);
    if (allocation_) for_each_block(tile, [&](int block) { allocation_->fields_of(block, archive); });
}
template void TileExchange::fields_of(std::int64_t tile, Packer& archive);
template void TileExchange::fields_of(std::int64_t tile, Unpacker& archive);

std::vector<std::int64_t> TileExchange::finish_round(const std::vector<std::int64_t>& own) {
    Packer packer;
    packer(own);
    std::vector<std::int64_t> others;
    const auto all = ranks_.gather("tiles done", packer.take());
    for (std::size_t r = 1; r < all.size(); ++r) {
        std::vector<std::int64_t> of_rank;
        Unpacker unpacker(all[r]);
        unpacker(of_rank);
        others.insert(others.end(), of_rank.begin(), of_rank.end());
    }
    ranks_.agree_to_stop();
    return others;
}

void TileExchange::bring_together() {
    count();
    tiles_on_ranks_.bring_to_rank_0(ranks_, "image", fields());
}

void TileExchange::count() {
    Packer packer;
    packer(tiles_.bad_samples(), scene_.rays(), scene_.invalid_rays());
    bad_ = {};
    rays_ = invalid_rays_ = 0;
    for (const std::span<const std::byte> bytes : ranks_.gather("counts", packer.take())) {
        BadSamples bad;
        std::uint64_t rays = 0, invalid_rays = 0;
        Unpacker unpacker(bytes);
        unpacker(bad, rays, invalid_rays);
        bad_.add(bad);
        rays_ += rays;
        invalid_rays_ += invalid_rays;
    }
}

void TileExchange::decide(int done) {
    if (!SampleAllocation::is_decision(done)) return;
    Packer packer;
    for (std::size_t t = 0; t < states_.size() && !ranks_.leads(); ++t) {
        if (!tiles_on_ranks_.is_here(t)) continue;
        packer(t);
        for_each_block(static_cast<std::int64_t>(t),
                       [&](int block) { allocation_->fields_for_decision(block, done, packer); });
    }
    const auto all = ranks_.gather("allocation", packer.take());
    for (std::size_t r = 1; r < all.size(); ++r) {
        Unpacker unpacker(all[r]);
        while (!unpacker.empty()) {
            std::size_t t = 0;
            unpacker(t);
            for_each_block(static_cast<std::int64_t>(t),
                           [&](int block) { allocation_->fields_for_decision(block, done, unpacker); });
        }
    }
    if (ranks_.leads()) allocation_->decide(done);
    share_allocation();
}

void TileExchange::share_allocation() {
    Packer packer;
    if (ranks_.leads()) allocation_->fields(packer);
    const std::vector<std::byte> bytes = ranks_.broadcast("allocation", packer.take());
    if (ranks_.leads()) return;
    Unpacker unpacker(bytes);
    allocation_->fields(unpacker);
}

}  // namespace lucerna
