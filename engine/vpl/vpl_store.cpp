#include "engine/vpl/vpl_store.h"

#include <algorithm>
#include <span>

#include "kdtree/node_order.h"

namespace lucerna {
namespace {

using Lights = std::span<const Vpl>;
using Places = std::vector<std::uint32_t>;

// Weights normals in the kd-tree: opposite ones are as far apart as positions at this share of the extent.
constexpr float kTurnOfNormal = 0.25F;

std::uint32_t blocks_for(std::size_t lights) {
    return static_cast<std::uint32_t>((lights + kBlock - 1) / kBlock);
}

Places places_of(Lights lights, bool in_medium) {
    Places places;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
        if (lights[i].in_medium == in_medium) places.push_back(i);
    }
    return places;
}

const V3f& direction_of(const Vpl& light) {
    return light.in_medium ? light.d : light.at.n;
}

// Puts the lights into the order of a kd-tree.
void order(Lights lights, Places& places, const Workers& workers) {
    if (places.size() <= kBlock) return;
    Box3f box;
    for (const std::uint32_t i : places) box.extendBy(lights[i].at.p);
    const float turn = 0.5F * kTurnOfNormal * box.size().length();
    std::vector<OrderEntry<6>> entries(places.size());
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        const V3f& p = lights[places[i]].at.p;
        const V3f n = turn * direction_of(lights[places[i]]);
        entries[i] = {{p.x, p.y, p.z, n.x, n.y, n.z}, i};
    }
    const std::vector<std::uint32_t> sorted = node_order<6>(std::move(entries), workers);
    Places result(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) result[i] = places[sorted[i]];
    places.swap(result);
}

void put(const Vpl& light, VplBlock& block, std::size_t lane) {
    const V3f& n = direction_of(light);
    block.x[lane] = light.at.p.x, block.y[lane] = light.at.p.y, block.z[lane] = light.at.p.z;
    block.nx[lane] = n.x, block.ny[lane] = n.y, block.nz[lane] = n.z;
    block.r[lane] = light.contribution.x;
    block.g[lane] = light.contribution.y;
    block.b[lane] = light.contribution.z;
    block.more[lane] = light.in_medium ? light.g : light.at.error;
}

void fill(Lights lights, const Places& places, VplBlock* blocks, BounceCount* bounces,
          std::uint32_t* origins) {
    for (std::size_t i = 0; i < blocks_for(places.size()) * kBlock; ++i) {
        const bool exists = i < places.size();
        Vpl light = lights[places[exists ? i : i / kBlock * kBlock]];
        if (!exists) light.contribution = Rgb(0);
        put(light, blocks[i / kBlock], i % kBlock);
        bounces[i] = light.bounces;
        if (origins) origins[i] = light.light;
    }
}

}  // namespace

VplStore::VplStore(const VplSets& sets, const Workers& workers) : lights_(sets.lights.size()) {
    // Each set is cut into lights on surfaces and lights in media.
    std::vector<Lights> parts;
    for (std::size_t s = 0; s + 1 < sets.begins.size(); ++s)
        parts.push_back(Lights(sets.lights).subspan(sets.begins[s], sets.begins[s + 1] - sets.begins[s]));
    std::uint32_t end = 0;
    for (const Lights& part : parts) {
        const auto in_media = static_cast<std::size_t>(
            std::count_if(part.begin(), part.end(), [](const Vpl& l) { return l.in_medium; }));
        VplRange range;
        range.surfaces = end;
        range.media = range.surfaces + blocks_for(part.size() - in_media);
        range.end = end = range.media + blocks_for(in_media);
        ranges_.push_back(range);
    }
    blocks_.resize(end);
    bounces_.resize(blocks_.size() * kBlock);
    if (std::ranges::any_of(sets.lights, [](const Vpl& light) { return light.light != 0; }))
        origins_.resize(bounces_.size());
    double sum = 0;
    for (const Vpl& light : sets.lights) sum += static_cast<double>(luminance(light.contribution));
    if (sum > 0) unit_ = static_cast<float>(static_cast<double>(lights_) / sum);

    // Many sets are ordered side by side. Where there are few, all workers order each of them.
    const bool side_by_side = parts.size() >= static_cast<std::size_t>(workers.threads);
    const Workers outer{side_by_side ? workers.threads : 1}, inner{side_by_side ? 1 : workers.threads};
    parallel_chunks(outer, static_cast<std::int64_t>(parts.size()), [&](std::int64_t set) {
        const auto s = static_cast<std::size_t>(set);
        for (const bool in_medium : {false, true}) {
            Places places = places_of(parts[s], in_medium);
            order(parts[s], places, inner);
            const std::size_t first = in_medium ? ranges_[s].media : ranges_[s].surfaces;
            fill(parts[s], places, blocks_.data() + first, bounces_.data() + first * kBlock,
                 origins_.empty() ? nullptr : origins_.data() + first * kBlock);
        }
    });
}

Vpl VplStore::light(const VplRange& range, std::uint32_t place) const {
    const VplBlock& block = blocks_[place / kBlock];
    const std::size_t lane = place % kBlock;
    const V3f n(block.nx[lane], block.ny[lane], block.nz[lane]);
    Vpl light;
    light.at.p = {block.x[lane], block.y[lane], block.z[lane]};
    light.contribution = {block.r[lane], block.g[lane], block.b[lane]};
    light.in_medium = place / kBlock >= range.media;
    light.bounces = bounces_[place];
    if (!origins_.empty()) light.light = origins_[place];
    if (light.in_medium) {
        light.d = n;
        light.g = block.more[lane];
    } else {
        light.at.n = n;
        light.at.error = block.more[lane];
    }
    return light;
}

}  // namespace lucerna
