// Reads the directives of a scene file in order and applies their changes.
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

    // Reads the next frame, up to its WorldEnd or the end of the text. Returns nothing if no frame is left.
    std::optional<Draft> next();
    // Tells whether any text is left.
    bool more();
    // Warns that the remaining text is not read.
    void leave_rest();

  private:
    enum class Stage : std::uint8_t { options, world, ended };
    enum class Where : std::uint8_t { anywhere, options_only, world_only };
    enum class Part : std::uint8_t { neither, world, view };
    struct Entry {
        std::string_view name;
        Where where;
        Part part;  // part of the draft's text to which it belongs (SceneText)
        void (DirectiveReader::*action)();
    };
    // A file that is being read.
    struct Open {
        const Source* source;
        Tokens tokens;
        bool closes_block = false;  // for Import, whose changes end with the file
    };
    struct Saved {
        std::string_view directive;  // directive whose end is expected
        Place place;
        GraphicsState state;
    };

    static const std::vector<Entry>& table();
    void require_room();
    void directive();
    SceneText* part_of(const Entry& entry);
    void note_directive(const Entry& entry);
    // Reports malformed text that pbrt accepts.
    void depart_oddities(const Source& source);
    void begin_frame();
    void finish();
    void keep_options();
    // Tells whether the directive may stand here. Skips it otherwise, as pbrt does.
    bool stands_here(const Entry& entry);
    void skip_arguments();
    // Runs `read`. If it rejects the text, reports that with what is done `instead` and returns false.
    template <typename Read>
    bool leniently(const Params& params, std::string_view instead, const Read& read);
    void override_resolution();
    void open_file(const std::string& name, bool import);
    const Source& source_of(const std::filesystem::path& file, const std::string& name);
    void close_file();

    Tokens& tokens() { return files_.back().tokens; }
    std::string quoted(std::string_view what);
    // Returns an empty list if a matrix has another number of values, which it reports.
    std::vector<double> numbers(std::size_t count, std::string_view what);
    bool pass_wrong_list(const std::vector<double>& values);
    Params parameters(std::string_view kind, std::string_view target);
    // Sets CTM = CTM · m in pbrt's order, or leaves it unchanged if the product is not finite.
    void concatenate(const M44d& m, std::string_view what);
    void begin_block();
    // Returns false if there is no such opening, which it reports.
    bool end_block(std::string_view opening);
    bool end_block_around_object(std::string_view opening);
    void close_blocks(std::string_view before);
    // Warns if the current directive, of which a scene has one, occurred before.
    void once();
    // Reads the material, or returns white if the scene renders ambient occlusion.
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
    // Chooses an integrator that supports media if the scene has any.
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

    Draft draft_;    // current frame
    Draft options_;  // initial options of the next frame
    SceneText before_world_;
    Reading reading_;
    const SceneOverrides& overrides_;
    int frames_ = 0;  // number of complete frames
    Stage stage_ = Stage::options;
    std::uint64_t directives_ = 0;
    std::vector<Open> files_;
    std::map<std::string, const Source*, std::less<>> known_files_;  // included files by name
    std::size_t includes_ = 0, text_again_ = 0;  // number of files; bytes of repeated files
    std::vector<Saved> saved_;
    std::map<std::string, M44d, std::less<>> coordinate_systems_;
    std::map<std::string, std::size_t, std::less<>> objects_;  // index of each complete object
    std::string object_name_;                                  // name of the current object
    std::uint64_t shown_ = 0;  // instances in the world, including nested ones
    // Returns the message that no `kind` of this name was made, which is cached as scenes often repeat a
    // request.
    template <typename Made>
    const std::string& never_made(std::string_view kind, const std::string& name, const Made& made);
    std::map<std::string, std::string, std::less<>> never_made_;
    std::vector<std::string_view> seen_, seen_in_frame_;  // of directives such as Camera and Film
    bool ignores_integrator_ = false;                     // set once a Renderer has chosen one
    std::string_view name_;                               // the current directive and its place
    Place place_;
};

}  // namespace lucerna
