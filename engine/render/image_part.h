// A picture in parts that are rendered by commands which know nothing of each other, and put together again.
//
// A pixel is a function of the scene, the settings and the seed, wherever it is rendered: parts are the
// picture, cut up. Photons, guides and virtual lights are those of the whole picture in every part
// (FilmSettings::view_begin), so each part makes all of them.
#pragma once

#include <optional>

#include "engine/base/vec.h"
#include "engine/render/job.h"

namespace lucerna {

struct ImagePart {
    int number = 1, of = 1;  // from 1 on
};

// Pixels, `end` exclusive.
struct PixelBox {
    V2i begin, end;
    V2i size() const { return end - begin; }
    bool operator==(const PixelBox&) const = default;
};

// That part of a box: the parts are boxes of a grid, rows first, as square and as equal as they can be. None
// where there is no such grid: more columns or rows than pixels.
std::optional<PixelBox> box_of(const ImagePart& part, const PixelBox& whole);

// Has the film render that part of what it would. Throws InputError that says how many parts there may be.
void restrict_to(const ImagePart& part, FilmSettings& film);

}  // namespace lucerna
