#include "engine/pbrt/read_scene.h"

#include <memory>

#include "engine/base/files.h"
#include "engine/pbrt/directives.h"
#include "engine/pbrt/draft.h"

namespace lucerna {

Draft read_draft(std::string text, const std::filesystem::path& pretended_file,
                 const SceneOverrides& overrides, Monitor& monitor) {
    Draft draft;
    draft.sources.push_back(std::make_unique<Source>(pretended_file.string(), std::move(text)));
    DirectiveReader reader(draft, pretended_file, overrides, monitor);
    reader.read(*draft.sources.front());
    return draft;
}

Job read_scene_text(std::string text, const std::filesystem::path& pretended_file,
                    const SceneOverrides& overrides, const Workers& workers, Monitor& monitor) {
    Draft draft = read_draft(std::move(text), pretended_file, overrides, monitor);
    const FilmSettings film = draft.film;
    const IntegratorSettings integrator = draft.integrator;
    const int spp = draft.spp;
    std::vector<std::filesystem::path> files = std::move(draft.files);
    Assembled assembled = assemble(std::move(draft), workers, monitor);
    const Phase phase(monitor, "build scene", 0);
    return {Scene(std::move(assembled.parts), workers),
            Camera(assembled.camera),
            film,
            integrator,
            spp,
            std::move(files)};
}

Job read_scene(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
               Monitor& monitor) {
    std::error_code status;  // asked first: opening a pipe would wait for its writer
    if (std::filesystem::is_other(file, status)) throw InputError({file.string()}, "is no regular file");
    Job job = read_scene_text(read_text(file), file, overrides, workers, monitor);
    job.files.insert(job.files.begin(), file);
    return job;
}

}  // namespace lucerna
