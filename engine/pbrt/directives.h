// The directives of a scene file, in order: what each one changes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/state.h"

namespace lucerna {

class DirectiveReader {
  public:
    DirectiveReader(Draft& draft, const std::filesystem::path& file, const SceneOverrides& overrides,
                    Monitor& monitor);

    // Reads `main` and what it includes to the end.
    void read(const Source& main);

  private:
    enum class Stage : std::uint8_t { options, world, ended };
    enum class Where : std::uint8_t { anywhere, options_only, world_only };
    struct Entry {
        std::string_view name;
        Where where;
        void (DirectiveReader::*action)();
    };
    // A file that is being read.
    struct Open {
        const Source* source;
        Tokens tokens;
        bool closes_block = false;  // Import: what it changed ends with it
    };
    struct Saved {
        std::string_view directive;  // that must be matched
        Place place;
        GraphicsState state;
    };

    static const std::vector<Entry>& table();
    void directive();
    void finish();
    void override_resolution();
    void open_file(const std::string& name, bool import);
    void close_file();

    Tokens& tokens() { return files_.back().tokens; }
    std::string quoted(std::string_view what);
    std::vector<double> numbers(std::size_t count, std::string_view what);
    Params parameters(std::string_view kind, std::string_view target);
    // CTM = CTM · m in pbrt's order; refuses what cannot be undone.
    void concatenate(const std::optional<M44d>& m, std::string_view what);
    void begin_block();
    void end_block(std::string_view opening);
    // Warns if the directive at hand, of which a scene has one, was there before.
    void once();
    // The material, or white where the scene asks for ambient occlusion.
    Material read_made_of(const std::string& kind, Params& params);
    using OptionReader = void (*)(Reading&, const std::string& kind, Params&);
    void option_of_kind(std::string_view what, OptionReader reader);

    void identity();
    void translate();
    void scale();
    void rotate();
    void look_at_directive();
    void coordinate_system();
    void coord_sys_transform();
    void transform();
    void concat_transform();
    void active_transform();
    void transform_times();
    void reverse_orientation();
    void attribute_begin();
    void attribute_end();
    void transform_begin();
    void transform_end();
    void attribute();
    void world_begin();
    void world_end();
    void include();
    void import();
    void camera();
    void film();
    void sampler();
    void pixel_filter();
    void integrator();
    void renderer();
    void search_path();
    void accelerator();
    void color_space();
    void option();
    void medium_interface();
    void make_named_medium();
    void volume();
    void volume_integrator();
    // Takes an integrator that knows media if the scene has any.
    void integrate_media();
    void material();
    void make_named_material();
    void named_material();
    void texture();
    void object_begin();
    void object_end();
    void object_instance();
    void shape();
    void light_source();
    void area_light_source();

    Reading reading_;
    const SceneOverrides& overrides_;
    Stage stage_ = Stage::options;
    std::vector<Open> files_;
    std::vector<Saved> saved_;
    std::map<std::string, M44d, std::less<>> coordinate_systems_;
    std::map<std::string, std::size_t, std::less<>> objects_;  // that are complete
    std::string object_name_;                                  // of the one at hand
    std::vector<std::string_view> seen_once_;                  // of Camera, Film, ...
    bool ignores_integrator_ = false;                          // a Renderer has chosen one
    std::string_view name_;                                    // the directive at hand, and its place
    Place place_;
};

}  // namespace lucerna
