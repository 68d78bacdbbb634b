#include "engine/base/sampler.h"

#include <Random123/philox.h>

#include <algorithm>

namespace lucerna {
namespace {

// Uses Philox as a hash of four words under a two-word key.
r123::Philox4x32::ctr_type hash(std::uint64_t key, std::uint64_t a, std::uint32_t b, std::uint32_t c) {
    const r123::Philox4x32::ctr_type counter{
        {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a >> 32), b, c}};
    const r123::Philox4x32::key_type k{
        {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)}};
    return r123::Philox4x32()(counter, k);
}

std::uint64_t join(std::uint32_t low, std::uint32_t high) {
    return static_cast<std::uint64_t>(high) << 32 | low;
}

// These values of the third and fourth counter word derive a key from a key; draws use small numbers there.
constexpr std::uint32_t kDeriveKey = 0xffffffffU;
constexpr std::uint32_t kSplit = 0xfffffffeU;
constexpr std::uint32_t kSplitAlike = 0xfffffffdU;

}  // namespace

Sampler::Sampler(std::uint64_t seed, Purpose purpose, std::uint32_t pass, std::uint64_t path) : path_(path) {
    const auto h = hash(seed, join(static_cast<std::uint32_t>(purpose), pass), 0, kDeriveKey);
    key_ = join(h[0], h[1]);
}

Sampler Sampler::stratified(std::uint64_t seed, Purpose purpose, std::uint64_t family, std::uint32_t index) {
    Sampler sampler;
    const auto h = hash(seed, family, static_cast<std::uint32_t>(purpose) + 1, kDeriveKey);
    sampler.key_ = join(h[0], h[1]);
    sampler.take_index(index);
    sampler.stratified_ = true;
    return sampler;
}

std::uint32_t Sampler::word(std::uint32_t draw, std::uint32_t lane) const {
    return hash(key_, path(), draw, 0)[lane];
}

std::uint32_t Sampler::bits() {
    return word(draw_++, 0);
}

Sampler::Scrambles Sampler::scrambles(std::uint64_t key, std::uint32_t draw) {
    const auto h = hash(key, ~std::uint64_t{0}, draw, 1);
    return {h[0], h[1], h[2], h[3]};
}

float Sampler::next_unknown() {
    if (!stratified_) return to_unit(bits());
    return number(scrambles(key_, draw_++));
}

V2f Sampler::next2_unknown() {
    const std::uint32_t draw = draw_++;
    if (stratified_) return point(scrambles(key_, draw));
    const auto h = hash(key_, path_, draw, 0);
    return {to_unit(h[0]), to_unit(h[1])};
}

SamplerFamily::SamplerFamily(std::uint64_t seed, Purpose purpose, std::uint64_t family)
    : begin_(Sampler::stratified(seed, purpose, family, 0)) {
    for (std::uint32_t draw = 0; draw < kDraws; ++draw) {
        scrambles_[draw] = Sampler::scrambles(begin_.key_, draw);
    }
}

Sampler ImageSamplers::at(const V2i& pixel, std::uint32_t index) const {
    assert(pixel.x >= 0 && pixel.y >= 0);
    constexpr std::uint32_t kSide = 0xffffU;
    const auto x = static_cast<std::uint32_t>(pixel.x), y = static_cast<std::uint32_t>(pixel.y);
    const std::uint32_t number = morton(x & kSide, y & kSide);
    // A family has 2^32 pixels; larger images have several families.
    const std::uint32_t block = x >> 16 | (y >> 16) << 16;
    if (block == 0) return family_.path(index, number);
    return Sampler::stratified(seed_, purpose_, block, index).in_pixel(number);
}

Sampler Sampler::split(std::uint32_t branch) const {
    Sampler child;
    const auto h = hash(key_, path(), draw_, kSplit);
    child.key_ = join(h[0], h[1]);
    child.path_ = branch;
    return child;
}

Sampler Sampler::split_alike(std::uint32_t branch) const {
    if (!stratified_) return split(branch);
    Sampler child = *this;
    const auto h = hash(key_, branch, draw_, kSplitAlike);
    child.key_ = join(h[0], h[1]);
    child.draw_ = 0;
    child.known_ = 0;
    child.scrambles_ = nullptr;
    return child;
}

Sampler Sampler::split_alike(std::uint32_t branch, std::uint32_t index, std::uint32_t count) const {
    if (!stratified_) return split_stratified(branch, index);
    Sampler child = split_alike(branch);
    const std::uint64_t number = std::uint64_t{index_} * count + index;
    child.take_index(static_cast<std::uint32_t>(number));
    // A sequence has 2^32 points; further points come from other, independent sequences.
    if (const std::uint64_t sequence = number >> 32; sequence > 0) {
        const auto h = hash(child.key_, sequence, 0, kDeriveKey);
        child.key_ = join(h[0], h[1]);
    }
    return child;
}

Sampler Sampler::split_stratified(std::uint32_t branch, std::uint32_t index) const {
    Sampler child = split(branch);
    const auto h = hash(child.key_, branch, 0, kDeriveKey);
    child.key_ = join(h[0], h[1]);
    child.take_index(index);
    child.stratified_ = true;
    return child;
}

}  // namespace lucerna
