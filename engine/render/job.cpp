#include "engine/render/job.h"

namespace lucerna {

View view_of(const Job& job) {
    const FilmSettings& film = job.film;
    return {&job.camera, V2f(film.crop_begin), V2f(film.crop_begin + film.rendered_size())};
}

}  // namespace lucerna
