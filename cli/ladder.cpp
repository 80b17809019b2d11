#include "cli/ladder.h"

#include <fmt/format.h>

#include "cli/render_line.h"
#include "cli/stage_clock.h"
#include "core/image/error_estimate.h"
#include "core/image/flip.h"

namespace cli {

namespace {

/// What all rungs are rendered from and judged by.
struct Ladder {
    const Program& program;
    const LadderSettings& settings;
    const core::Scene& scene;
    const core::Camera& camera;
    const core::Image& reference;
    std::vector<glm::vec3> reference_radiance;

    RenderOptions rung_options(const Method& method, int samples, std::uint64_t rung) const {
        RenderOptions options = method.render;
        options.samples_per_pixel = samples;
        options.gather.frames = samples;
        options.seed = settings.seed + rung;
        options.output = fmt::format("{}_{}{}.exr", method.file_stem(), samples,
                                     options.renderer == RendererKind::kGather ? "frames" : "spp");
        return options;
    }

    core::Frame render(const Method& method, const RenderOptions& options) const {
        gather::Plan plan;
        if (options.renderer == RendererKind::kGather) {
            plan = gather::make_plan(scene, options.width, options.height, options.gather, options.effects);
        }
        return render_frame(program, options, scene, camera, *method.tracers, plan);
    }

    /// Returns the wall time of the rendering.
    double measure(Method& method, int samples, std::uint64_t rung) const {
        const RenderOptions options = rung_options(method, samples, rung);
        ReportPoint point;
        point.samples_per_pixel = samples;
        point.seed = options.seed;
        point.command = render_line(options, program.common.allow_external);

        const double cpu_start = process_cpu_seconds();
        StageClock clock;
        core::Frame frame = render(method, options);
        point.seconds = clock.lap();
        point.cpu_seconds = process_cpu_seconds() - cpu_start;
        point.rays = frame.rays;
        judge(frame.image, method, point);

        method.exhausted_rays += frame.exhausted_rays;
        set_stages(frame, method.series);
        method.last = std::move(frame.image);
        note(program,
             fmt::format("{}, {}: {:.2f} s, relMSE {:.4g}, FLIP {:.4f}", method.series.method,
                         method.series.rung_name(samples), point.seconds, point.rel_mse.value, point.flip));
        method.series.points.push_back(std::move(point));
        return method.series.points.back().seconds;
    }

    void judge(const core::Image& image, Method& method, ReportPoint& point) const {
        const std::vector<glm::vec3> radiance = *image.color();
        point.metrics = core::compare_images(radiance, reference_radiance);
        point.blocks = core::corrected_rel_mse_blocks(image, reference);
        const core::ErrorInterval corrected = core::mean_error(point.blocks);
        point.rel_mse = {corrected.value, corrected.low, corrected.high};
        core::FlipResult flip = core::flip_hdr(radiance, reference_radiance, image.width(), image.height());
        point.flip = flip.mean;
        method.last_flip = std::move(flip.map);
    }

    static void set_stages(const core::Frame& frame, ReportSeries& series) {
        series.stages = {{"load", series.load_seconds, 0},
                         {"bake", series.bake_seconds, 0},
                         {"build", series.build_seconds, 0}};
        for (const core::PassCost& pass : frame.passes) {
            series.stages.push_back({pass.name, pass.seconds, pass.rays});
        }
    }
};

}  // namespace

void climb_ladder(const Program& program, const LadderSettings& settings, const core::Scene& scene,
                  const core::Camera& camera, const core::Image& reference, std::vector<Method>& methods) {
    const Ladder ladder{program, settings, scene, camera, reference, *reference.color()};
    for (const Method& method : methods) {
        ladder.render(method, ladder.rung_options(method, 1, 0));
    }
    double spent = 0.0;
    std::uint64_t rung = 0;
    for (int samples = 1; samples <= settings.max_samples; samples *= 2, ++rung) {
        double rung_seconds = 0.0;
        for (std::size_t i = 0; i < methods.size(); ++i) {
            rung_seconds += ladder.measure(methods[(i + rung) % methods.size()], samples, rung);
        }
        spent += rung_seconds;
        // The next rung takes twice as long.
        const bool is_last = 2 * samples > settings.max_samples;
        if (!is_last && settings.time_budget_seconds > 0.0 &&
            spent + 2.0 * rung_seconds > settings.time_budget_seconds) {
            note(program, fmt::format("--time-budget {}: the ladder ends at {} samples a pixel",
                                      settings.time_budget_seconds, samples));
            break;
        }
    }
}

}  // namespace cli
