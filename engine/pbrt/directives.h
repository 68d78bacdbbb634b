// The directives of a scene file, in order: what each one changes.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/state.h"

namespace lucerna {

class DirectiveReader {
  public:
    DirectiveReader(std::string text, const std::filesystem::path& file, const SceneOverrides& overrides,
                    Monitor& monitor);
    DirectiveReader(const DirectiveReader&) = delete;
    DirectiveReader& operator=(const DirectiveReader&) = delete;

    // Reads the next frame, up to its WorldEnd or the end of the text; none if no frame is left.
    std::optional<Draft> next();
    // Whether any text is left.
    bool more();
    // Says that text which is left is not read.
    void leave_rest();

  private:
    enum class Stage : std::uint8_t { options, world, ended };
    enum class Where : std::uint8_t { anywhere, options_only, world_only };
    enum class Part : std::uint8_t { neither, world, view };
    struct Entry {
        std::string_view name;
        Where where;
        Part part;  // of the draft's text that it belongs to (SceneText)
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
    void require_room();
    void directive();
    SceneText* part_of(const Entry& entry);
    void note_directive(const Entry& entry);
    // What pbrt takes although it is not well formed.
    void depart_oddities(const Source& source);
    void begin_frame();
    void finish();
    void keep_options();
    // Whether the directive may stand here; passed over if not, as pbrt does.
    bool stands_here(const Entry& entry);
    void skip_arguments();
    // Runs `read`; what it cannot take of the text is said, with what is done `instead`. False: that
    // happened.
    template <typename Read>
    bool leniently(const Params& params, std::string_view instead, const Read& read);
    void override_resolution();
    void open_file(const std::string& name, bool import);
    const Source& source_of(const std::filesystem::path& file, const std::string& name);
    void close_file();

    Tokens& tokens() { return files_.back().tokens; }
    std::string quoted(std::string_view what);
    // Empty: a matrix has another number of them, which was said.
    std::vector<double> numbers(std::size_t count, std::string_view what);
    bool pass_wrong_list(const std::vector<double>& values);
    Params parameters(std::string_view kind, std::string_view target);
    // CTM = CTM · m in pbrt's order; what is not finite leaves it as it is.
    void concatenate(const M44d& m, std::string_view what);
    void begin_block();
    // False: there was no such opening, which was said.
    bool end_block(std::string_view opening);
    bool end_block_around_object(std::string_view opening);
    void close_blocks(std::string_view before);
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
    void choose_working_space(std::string_view name);
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
    void choose_unit(Params& params);
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
    void complete_object();
    void object_instance();
    void shape();
    void calculation_surface();
    void light_source();
    void area_light_source();

    Draft draft_;    // of the frame at hand
    Draft options_;  // what the next frame begins with
    SceneText before_world_;
    Reading reading_;
    const SceneOverrides& overrides_;
    int frames_ = 0;  // that are complete
    Stage stage_ = Stage::options;
    std::uint64_t directives_ = 0;
    std::vector<Open> files_;
    std::map<std::string, const Source*, std::less<>> known_files_;  // that were included, by name
    std::size_t includes_ = 0, text_again_ = 0;                      // files; bytes of those read before
    std::vector<Saved> saved_;
    std::map<std::string, M44d, std::less<>> coordinate_systems_;
    std::map<std::string, std::size_t, std::less<>> objects_;  // that are complete
    std::string object_name_;                                  // of the one at hand
    std::uint64_t shown_ = 0;  // instances in the world, those within them, too
    // That something of this kind was never made, by kind and name: scenes ask for the same thing often.
    template <typename Made>
    const std::string& never_made(std::string_view kind, const std::string& name, const Made& made);
    std::map<std::string, std::string, std::less<>> never_made_;
    std::vector<std::string_view> seen_, seen_in_frame_;  // of Camera, Film, ...
    bool ignores_integrator_ = false;                     // a Renderer has chosen one
    std::string_view name_;                               // the directive at hand, and its place
    Place place_;
};

}  // namespace lucerna
