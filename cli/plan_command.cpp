// cli/plan_command.cpp: the flags of `fieldlight plan`.
#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/gather_flags.h"
#include "cli/options.h"
#include "cli/scene_setup.h"

namespace cli {

namespace {

struct PlanFlags {
    SceneOptions scene;
    std::string size = "1280x720";
    GatherFlags gather;
};

void run_plan(const Program& program, const PlanFlags& flags) {
    const glm::ivec2 size = parse_size(flags.size);
    const gather::Settings settings = flags.gather.settings();
    const gather::EffectRequest request = flags.gather.effects();
    const core::Scene scene = load_scene(program, flags.scene);
    const gather::Plan plan = gather::make_plan(scene, size.x, size.y, settings, request);
    nlohmann::json effects = nlohmann::json::object();
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        const auto effect = static_cast<gather::Effect>(i);
        const gather::PlannedEffect& planned = plan[effect];
        if (program.common.json) {
            effects[std::string(gather::name_of(effect))] = {
                {"on", planned.on}, {"reason", planned.reason}, {"cost", planned.cost}};
        } else {
            std::cout << fmt::format("{:<18} {:<4} {}{}\n", gather::name_of(effect),
                                     planned.on ? "on" : "off", planned.reason,
                                     planned.on ? fmt::format("; {}", planned.cost) : "");
        }
    }
    if (program.common.json) std::cout << nlohmann::json{{"schema", 1}, {"effects", effects}}.dump() << "\n";
}

}  // namespace

void add_plan_command(CLI::App& app, Program& program) {
    CLI::App* verb = app.add_subcommand("plan", "Say which effects a scene calls for, and why");
    auto flags = std::make_shared<PlanFlags>();
    add_scene_file(*verb, flags->scene);
    add_scene_options(*verb, flags->scene);
    verb->add_option("--size", flags->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    flags->gather.add_to(*verb);
    add_common_options(*verb, program.common);
    verb->footer(
        "Examples:\n"
        "  fieldlight plan assets/cornell_box.glb\n"
        "  fieldlight plan room.glb --sun 30,40,60000 --accumulate 1 --json");
    verb->callback([flags, &program] { run_verb(program, [&] { run_plan(program, *flags); }); });
}

}  // namespace cli
