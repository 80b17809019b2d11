#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report.h"
#include "cli/report_assets.h"
#include "cli/report_bars.h"
#include "cli/report_markup.h"
#include "cli/report_pictures.h"
#include "cli/report_plot.h"
#include "cli/report_series.h"
#include "cli/report_tables.h"

namespace cli {

namespace {

constexpr std::size_t kPageBytes = 10'000'000;
constexpr std::size_t kWarningsShown = 50;

/// What the page may do, told to the browser: nothing leaves it, whatever a scene is called.
constexpr std::string_view kPolicy =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri "
    "'none'; "
    "form-action 'none'";

struct Term {
    const char* term;
    const char* definition;
};

const Term kTerms[] = {
    {"I, R, Y",
     "the picture under test, the reference, Rec. 709 luminance; linear radiance in cd/m². Means run over "
     "pixels and "
     "channels."},
    {"Methods",
     "triangles, and fields by their voxels on the longest side of a mesh, through the path tracer; through "
     "the gather where its name stands before them. Samples of the gather are the frames that it averages."},
    {"relMSE", "mean (I − R)² / (R² + 0.01), untrimmed. The reference’s own variance is subtracted."},
    {"Relative error", "100 √relMSE, in percent. Shown as 0 where the subtracted variance was the larger."},
    {"b, v",
     "the fit relMSE(t) = b² + v/t over warm wall time: b is the floor that no time removes, v the time to a "
     "relative "
     "error of 100 % above it. Both need three points."},
    {"Warm, cold", "the wall time of the rendering alone; the same with loading, baking and building."},
    {"95 % intervals",
     "of the value beside them: of measured errors by a jackknife over blocks of 16 × 16 pixels (smaller in "
     "small "
     "pictures), of fitted values by how points scatter around the fit. Where two overlap, no method is "
     "called better, "
     "but for the error at equal time, which is decided in pairs."},
    {"Paired, winner",
     "at equal time each two methods are compared block by block against the one reference: the square of "
     "its noise is "
     "in both and cancels. The difference of their relMSE has a 95 % interval (Student’s t) from how far "
     "each block’s "
     "difference is from what the methods’ other rungs, rendered with other seeds, foretell of it, so that "
     "what the "
     "view itself makes of it does not count as uncertain. A pair is decided where the interval leaves 0 "
     "out; the "
     "winner is the method that is decided to be better than every other. Times count as exact."},
    {"Equal time",
     "the longest time that every method reached. A method that has no point there is read off between its "
     "two "
     "nearest, as b² + v/t through both."},
    {"Seeds",
     "the random numbers of a picture: each rung has its own seed, the same for all methods, and the "
     "reference one "
     "that no rung has."},
    {"Dominated", "another point has less error in no more warm time. Such points are hollow."},
    {"FLIP",
     "mean HDR FLIP against the reference, 67 pixels a degree: 0 is equal, 1 as different as can be "
     "(Andersson et al. "
     "2020, 2021)."},
    {"Leak",
     "sum of max(Y_I − Y_R, 0) where Y_R is at most 10⁻⁴ of its median over positive pixels, of the sum of "
     "Y_R. It "
     "counts only where the lit side is right within 2 %."},
    {"Relative error of a pixel", "|Y_I − Y_R| / (|Y_R| + 0.01)."},
    {"Voxel", "the grid spacing of the mesh’s own field, in the mesh’s own scale at the hit."},
};

std::string fact(std::string_view name, std::string_view value_html) {
    return fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", name, value_html);
}

/// The same for text from outside; nothing where it is empty.
std::string text_fact(std::string_view name, std::string_view text) {
    return text.empty() ? std::string() : fact(name, escape_html(text));
}

std::string warnings(const Report& report) {
    if (report.warnings.empty()) return "";
    std::string html = "<div class=\"warnings\" role=\"note\"><h2>Warnings</h2><ul>\n";
    const std::size_t shown = std::min(report.warnings.size(), kWarningsShown);
    for (std::size_t i = 0; i < shown; ++i)
        html += fmt::format("<li>{}</li>\n", escape_html(report.warnings[i]));
    if (shown < report.warnings.size())
        html += fmt::format("<li>and {} more in report.json</li>\n", grouped(report.warnings.size() - shown));
    return html + "</ul></div>\n";
}

/// Keeps percent signs with their numbers.
std::string unbroken(std::string html) {
    for (std::size_t at = html.find(" %"); at != std::string::npos; at = html.find(" %", at))
        html.replace(at, 1, "&#160;");
    return html;
}

/// 2025-01-31T12:34:56Z as 2025-01-31 12:34 UTC; other dates as they are.
std::string readable(const std::string& date) {
    if (date.size() < 17 || date[10] != 'T' || date.back() != 'Z') return date;
    return date.substr(0, 10) + ' ' + date.substr(11, 5) + " UTC";
}

std::string header(const Report& report, std::string_view navigation) {
    return fmt::format(
        "<header>\n<p class=\"eyebrow\">Fieldlight · distance fields against triangles</p>\n<h1>{}</h1>\n"
        "<p class=\"verdict\">{}</p>\n<p class=\"note\">{} × {} pixels · {} · {} {} · {}</p>\n{}"
        "<nav aria-label=\"Sections\">{}</nav>\n</header>\n",
        escape_html(report.scene), unbroken(escape_html(report.verdict)), report.width, report.height,
        report.bounces < 0 ? std::string("bounces without limit") : fmt::format("{} bounces", report.bounces),
        report.threads, report.threads == 1 ? "thread" : "threads", escape_html(readable(report.date)),
        warnings(report), navigation);
}

std::string plots(const Report& report) {
    struct Variant {
        const char* name;
        const char* label;
        CostAxis axis;
    };
    constexpr Variant kVariants[] = {{"warm", "Wall, warm", CostAxis::kWarm},
                                     {"cold", "Wall, cold", CostAxis::kCold},
                                     {"cpu", "CPU", CostAxis::kProcessor},
                                     {"rays", "Rays", CostAxis::kRays}};
    std::string inputs, figures;
    for (const Variant& variant : kVariants) {
        const std::string svg = error_plot(report, variant.axis);
        if (svg.empty()) continue;
        inputs += fmt::format(
            "<input type=\"radio\" name=\"axis\" id=\"axis-{0}\"{1}><label for=\"axis-{0}\">{2}</label>\n",
            variant.name, inputs.empty() ? " checked" : "", variant.label);
        figures +=
            fmt::format("<div class=\"figure {}\"><div class=\"scroll\">{}</div></div>\n", variant.name, svg);
    }
    if (inputs.empty()) return "";
    return "<p class=\"note\">Bars and bands are 95 % intervals. Over wall time the dashed curve is the fit "
           "relMSE(t) = "
           "b² + v/t, carried on to the right, and the dotted line its floor b. Hollow points are dominated: "
           "another "
           "has less error in no more warm time. A point links to the command that renders it.</p>\n"
           "<fieldset class=\"axes\"><legend>Against</legend>\n" +
           inputs + figures + "</fieldset>\n";
}

std::string url_encoded(std::string_view text) {
    std::string result;
    for (const char letter : text) {
        const auto byte = static_cast<unsigned char>(letter);
        const bool plain =
            byte < 0x80 && (std::isalnum(byte) != 0 || letter == '-' || letter == '_' || letter == '.');
        result += plain ? std::string(1, letter) : fmt::format("%{:02X}", byte);
    }
    return result;
}

std::string thumbnails(const ReportPicture& picture, const EncodedPicture& encoded,
                       const EncodedPictures& all) {
    struct Map {
        const std::string& uri;
        const char* caption;
        const char* mode;
    };
    const Map maps[] = {{encoded.color, "tone-mapped", "a"},
                        {encoded.flip, "FLIP", "flip"},
                        {encoded.error, "relative error", "error"},
                        {encoded.steps, "tracer steps", "steps"}};
    std::string html = fmt::format("<article class=\"picture\"><h3>{}{}</h3><div class=\"maps\">\n",
                                   escape_html(picture.name),
                                   encoded.exact ? "" : " <small class=\"quiet\">thumbnails only</small>");
    for (const Map& map : maps) {
        if (map.uri.empty()) continue;
        std::string image =
            fmt::format("<img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}, {}\">", map.uri,
                        all.thumbnail_width, all.thumbnail_height, escape_html(picture.name), map.caption);
        if (encoded.exact)
            image = fmt::format("<a href=\"#a={}&amp;mode={}\">{}</a>", url_encoded(picture.name), map.mode,
                                image);
        html += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", image, map.caption);
    }
    return html + "</div></article>\n";
}

std::string scale_legend(std::string_view name, const HeatScale& scale, double factor,
                         std::string_view unit) {
    return fmt::format("<span>{} {}{}<i class=\"{}\"></i>{}{}</span>\n", name, trimmed(scale.low * factor),
                       unit, scale.map == HeatMap::kMagma ? "magma" : "viridis", trimmed(scale.high * factor),
                       unit);
}

std::string pictures(const Report& report, std::size_t budget) {
    if (report.pictures.empty()) return "";
    const EncodedPictures all = encode_pictures(report, budget);
    std::string left_out;
    for (std::size_t i = 0; i < all.pictures.size(); ++i)
        if (!all.pictures[i].exact)
            left_out += (left_out.empty() ? "" : ", ") + escape_html(report.pictures[i].name);
    std::string html = fmt::format(
        "<p class=\"note\">The last rung of each method. Tone-mapped with the ACES curve at EV100 {}, chosen "
        "on the "
        "reference, the same for all.</p>\n",
        fixed(all.ev, 2));
    if (!left_out.empty()) {
        html += fmt::format(
            "<p class=\"note\">The page stays under 10 MB, so that these are here as thumbnails only; their "
            "exact "
            "values are in the EXR files of this folder: {}.</p>\n",
            left_out);
    }
    html += report_viewer();
    html += "<p class=\"scales\">" + scale_legend("FLIP", kFlipScale, 1.0, "") +
            scale_legend("Relative error, logarithmic", kErrorScale, 100.0, " %") +
            scale_legend("Steps a camera ray", all.steps, 1.0, "") + "</p>\n";
    for (std::size_t i = 0; i < all.pictures.size(); ++i)
        html += thumbnails(report.pictures[i], all.pictures[i], all);
    return html + all.data;
}

std::string command_line(std::string_view id, std::string_view what_html, std::string_view command) {
    if (command.empty()) return "";
    return fmt::format("<div class=\"command\"{}><span>{}</span><code>{}</code></div>\n",
                       id.empty() ? std::string() : fmt::format(" id=\"{}\"", id), what_html,
                       escape_html(command));
}

std::string commands(const Report& report) {
    std::string html = "<h3>Report and reference</h3>\n" + command_line("", "report", report.command) +
                       command_line("", "reference", report.reference_command);
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        const ReportSeries& series = report.series[i];
        if (series.points.empty()) continue;
        html += fmt::format("<h3>{}</h3>\n", series_name(report, i));
        for (std::size_t k = 0; k < series.points.size(); ++k)
            html +=
                command_line(fmt::format("run-{}-{}", i, k),
                             series.rung_name(series.points[k].samples_per_pixel), series.points[k].command);
    }
    return "<p class=\"note\">Each renders the picture of its point. A click selects a whole command.</p>\n"
           "<div class=\"commands\">\n" +
           html + "</div>\n";
}

/// What the reference cost, and whether this run paid it.
std::string reference_price(const Report& report) {
    if (!report.reference_reused) return significant(report.reference_seconds) + " s";
    if (!report.reference_render_seconds) return "reused from an earlier run, which did not record its time";
    return fmt::format("{} s in an earlier run, reused", significant(*report.reference_render_seconds));
}

std::string settings(const Report& report) {
    std::string html = "<dl class=\"facts\">\n" + text_fact("Scene", report.scene) +
                       text_fact("Hash of the scene", report.scene_hash) +
                       text_fact("Camera", report.camera) + text_fact("Sky", report.sky) +
                       text_fact("Sun", report.sun) +
                       fact("Size", fmt::format("{} × {} pixels", report.width, report.height)) +
                       fact("Bounces", report.bounces < 0 ? "no limit" : fmt::format("{}", report.bounces)) +
                       fact("Seed", fmt::format("{}", report.seed));
    html += fact("Reference",
                 fmt::format("{} samples a pixel, {}",
                             grouped(static_cast<std::uint64_t>(std::max(report.reference_samples, 0))),
                             reference_price(report)));
    html += fact("Seed of the reference", fmt::format("{}", report.reference_seed));
    html += fact("Noise of the reference", significant(error_percent(report.reference_rel_variance)) + " %");
    html +=
        text_fact("Processor", report.processor) +
        fact("Cores, threads", fmt::format("{}, {}", report.cores, report.threads)) +
        fact("Most memory held", significant(1e-6 * static_cast<double>(report.peak_bytes)) + " MB") +
        text_fact("Instruction set", report.isa) + text_fact("System", report.system) +
        text_fact("Compiler", report.compiler) + text_fact("Flags", report.flags) +
        text_fact("Fieldlight", report.version + (report.commit.empty() ? "" : ", commit " + report.commit)) +
        text_fact("Date", report.date);
    return html + "</dl>\n";
}

std::string definitions() {
    std::string html = "<dl class=\"terms\">\n";
    for (const Term& term : kTerms)
        html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", term.term, term.definition);
    return html + "</dl>\n";
}

constexpr std::string_view kLimits =
    "<p>Seconds belong to the machine named above, as busy as it was; ratios within this page say more than "
    "the "
    "seconds do. Time to 5 % and values at equal time are read off the fit, not measured there. The fit "
    "knows two "
    "terms: where error falls faster or slower than 1/√t its floor is off. One view of one scene says "
    "nothing about "
    "others.</p>\n";

std::string style() {
    return fmt::format("<style>\n{}.magma {{ background: {} }}\n.viridis {{ background: {} }}\n</style>\n",
                       report_style(), css_gradient(HeatMap::kMagma), css_gradient(HeatMap::kViridis));
}

/// One part of the page.
struct Section {
    const char* id;
    const char* name;   ///< In the line of links.
    const char* title;  ///< Above it.
    std::string body;   ///< HTML; empty where there is nothing to tell.
};

std::string section_html(const Section& section) {
    if (section.body.empty()) return "";
    return fmt::format(
        "<section id=\"{0}\" aria-labelledby=\"{0}-title\">\n<h2 id=\"{0}-title\">{1}</h2>\n{2}</section>\n",
        section.id, section.title, section.body);
}

std::vector<Section> sections_of(const Report& report) {
    std::vector<Section> sections = {
        {"summary", "Summary", "What accuracy costs", summary_table(report) + paired_table(report)},
        {"error", "Error against time", "Error against time", plots(report)},
        {"pictures", "Pictures", "Pictures", ""},
        {"geometry", "Geometry", "Fields against triangles, ray by ray", geometry_table(report)},
        {"cost", "Cost by stage", "Cost by stage, last rung of each method",
         stage_bars(report) + stage_table(report)},
        {"runs", "All points", "All points", runs_table(report)},
        {"commands", "Commands", "Commands", commands(report)},
        {"settings", "Settings", "Settings and machine", settings(report)},
        {"definitions", "Definitions", "Definitions", definitions()},
        {"limits", "Limits", "Limits", std::string(kLimits)}};
    std::size_t bytes = report_style().size() + report_script().size() + header(report, "").size();
    for (const Section& section : sections) bytes += section.body.size();
    // Whatever the text took, the pictures share the rest; some room for the frame and their captions.
    constexpr std::size_t kFrame = 100'000;
    for (Section& section : sections)
        if (std::string_view(section.id) == "pictures")
            section.body = pictures(report, kPageBytes - std::min(kPageBytes, bytes + kFrame));
    return sections;
}

}  // namespace

std::string report_html(const Report& report) {
    std::string navigation, body;
    for (const Section& section : sections_of(report)) {
        if (!section.body.empty())
            navigation += fmt::format("<a href=\"#{}\">{}</a>\n", section.id, section.name);
        body += section_html(section);
    }
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{} · "
        "Fieldlight</title>\n"
        "<link rel=\"icon\" href=\"data:,\">\n{}</head>\n<body>\n{}<main>\n",
        kPolicy, escape_html(report.scene), style(), header(report, navigation));
    html += body;
    html +=
        "</main>\n<footer>One file: nothing is loaded from elsewhere. The same numbers stand in report.json "
        "and "
        "report.csv.</footer>\n<script>\n";
    html += report_script();
    return html + "</script>\n</body>\n</html>\n";
}

}  // namespace cli
