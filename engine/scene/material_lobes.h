// From a material to the lobes of one hit; behind make_bsdf.
#pragma once

#include <array>
#include <span>

#include "engine/scene/material.h"

namespace lucerna {

class LobeList {
  public:
    void add(const Lobe& lobe) { lobes_[count_++] = lobe; }
    std::span<const Lobe> all() const { return {lobes_.data(), count_}; }
    std::span<Lobe> from(std::size_t first) { return {lobes_.data() + first, count_ - first}; }
    std::size_t size() const { return count_; }

  private:
    std::array<Lobe, Bsdf::kMaxLobes> lobes_;  // most_lobes() bounds what is added
    std::size_t count_ = 0;
};

void add_lobes(const MaterialModel& model, const TexturePoint& point, LobeList& list);

}  // namespace lucerna
