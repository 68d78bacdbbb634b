#include "engine/render/image_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "engine/base/error.h"

namespace lucerna {
namespace {

// Where the piece `i` of `pieces` of a side begins, or the one before it ends.
int edge(int begin, int end, int i, int pieces) {
    return begin + static_cast<int>(std::int64_t{end - begin} * i / pieces);
}

}  // namespace

std::optional<PixelBox> box_of(const ImagePart& part, const PixelBox& whole) {
    const V2i size = whole.size();
    // The least sum of a box's sides, of all grids of as many boxes.
    int columns = 0;
    double least = 0;
    for (int across = 1; across <= std::min(part.of, size.x); ++across) {
        if (part.of % across != 0 || part.of / across > size.y) continue;
        const double sides = double(size.x) / across + double(size.y) * across / part.of;
        if (columns == 0 || sides < least) columns = across, least = sides;
    }
    if (columns == 0) return std::nullopt;
    const int rows = part.of / columns, column = (part.number - 1) % columns,
              row = (part.number - 1) / columns;
    return PixelBox{
        {edge(whole.begin.x, whole.end.x, column, columns), edge(whole.begin.y, whole.end.y, row, rows)},
        {edge(whole.begin.x, whole.end.x, column + 1, columns),
         edge(whole.begin.y, whole.end.y, row + 1, rows)}};
}

void restrict_to(const ImagePart& part, FilmSettings& film) {
    const PixelBox whole{film.crop_begin, film.crop_begin + film.rendered_size()};
    const std::optional<PixelBox> own = box_of(part, whole);
    if (!own) {
        throw InputError(fmt::format(
            "{} x {} pixels cannot be divided into {} parts of whole columns and rows; use fewer parts",
            whole.size().x, whole.size().y, part.of));
    }
    film.view_begin = whole.begin, film.view_end = whole.end;
    film.crop_begin = own->begin, film.crop_end = own->end;
}

}  // namespace lucerna
