// tests/cli/report_html_test.cpp: the page as text: whole, closed to the outside, small enough, and true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report.h"
#include "cli/report_assets.h"
#include "cli/report_plot.h"
#include "tests/cli/sample_report.h"

namespace {

/// An opening tag as a browser would see it.
struct Tag {
    std::string name;
    std::map<std::string, std::string> attributes;
};

/// Reads a page by the rules that ours is written by: lower-case tags, attributes in double quotes, each
/// element closed but the void ones. Faults are what a browser would have to guess at.
struct Page {
    std::vector<Tag> tags;
    std::vector<std::string> faults;
    std::string text;  ///< Between the tags; without scripts and styles.
};

bool is_void(const std::string& name) {
    static const std::set<std::string> names = {"meta", "link", "input", "img", "br"};
    return names.count(name) > 0;
}

Page read_page(const std::string& html) {
    Page page;
    std::vector<std::string> open;
    std::size_t at = html.find('>') + 1;  // Behind the doctype.
    while (at < html.size()) {
        const std::size_t begin = html.find('<', at);
        page.text += html.substr(at, begin - at);
        if (begin == std::string::npos) break;
        const bool closes = html[begin + 1] == '/';
        std::size_t cursor = begin + (closes ? 2 : 1);
        Tag tag;
        while (cursor < html.size() && std::isalnum(static_cast<unsigned char>(html[cursor])))
            tag.name += html[cursor++];
        if (tag.name.empty()) page.faults.push_back("a '<' that opens nothing: " + html.substr(begin, 40));
        bool self_closed = false;
        while (cursor < html.size() && html[cursor] != '>') {
            if (html[cursor] == '/') self_closed = true;
            if (std::isspace(static_cast<unsigned char>(html[cursor])) || html[cursor] == '/') {
                ++cursor;
                continue;
            }
            const std::size_t name_end = html.find_first_of("= >/", cursor);
            const std::string name = html.substr(cursor, name_end - cursor);
            cursor = name_end;
            std::string value;
            if (html[cursor] == '=') {
                if (html[cursor + 1] != '"') page.faults.push_back(tag.name + " " + name + ": no quote");
                const std::size_t end = html.find('"', cursor + 2);
                value = html.substr(cursor + 2, end - cursor - 2);
                if (value.find('<') != std::string::npos) page.faults.push_back(name + " holds a '<'");
                cursor = end + 1;
            }
            if (!tag.attributes.emplace(name, value).second) page.faults.push_back(name + " twice");
        }
        at = cursor + 1;
        if (closes) {
            if (open.empty() || open.back() != tag.name)
                page.faults.push_back("</" + tag.name + "> inside <" + (open.empty() ? "" : open.back()) +
                                      ">");
            else
                open.pop_back();
            continue;
        }
        page.tags.push_back(tag);
        if (self_closed || is_void(tag.name)) continue;
        if (tag.name == "script" || tag.name == "style") {
            at = html.find("</" + tag.name + ">", at);
            if (at == std::string::npos) return page.faults.push_back(tag.name + " has no end"), page;
            at += tag.name.size() + 3;
            continue;
        }
        open.push_back(tag.name);
    }
    for (const std::string& name : open) page.faults.push_back(name + " is not closed");
    return page;
}

std::size_t count(const std::string& text, std::string_view part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

/// Reports that exercise each part of the page and its absence.
std::map<std::string, cli::Report> reports() {
    std::map<std::string, cli::Report> all;
    all["sample"] = tests::sample_report();
    all["nothing"] = {};
    all["without pictures"] = tests::sample_report();
    all["without pictures"].pictures.clear();
    all["one picture"] = tests::sample_report();
    all["one picture"].pictures.resize(1);
    all["one point a series"] = tests::sample_report();
    for (cli::ReportSeries& series : all["one point a series"].series) {
        series.points.resize(1);
        series.floor = series.variance_seconds = series.rel_mse_at_equal_time =
            series.seconds_to_5_percent = {};
    }
    all["no points"] = tests::sample_report();
    for (cli::ReportSeries& series : all["no points"].series) series.points.clear();
    all["extreme"] = tests::sample_report();
    cli::ReportSeries& extreme = all["extreme"].series[1];
    extreme.points.resize(2);
    extreme.points[0].seconds = 1e-300;
    extreme.points[1].seconds = 1e300;
    extreme.points[0].rel_mse = {1e-300, 0.0, 1e300};
    extreme.points[1].rel_mse = {1e300, -1e300, HUGE_VAL};
    extreme.stages = {{"endless", HUGE_VAL, ~0ull}, {"none", 0.0, 0}, {"less", -1.0, 1}};
    all["many series"] = tests::sample_report();
    for (int i = 0; i < 20; ++i) {
        all["many series"].series.push_back(all["many series"].series[2]);
        all["many series"].series.back().method = "fields " + std::to_string(1000 + i);
    }
    return all;
}

TEST(ReportPage, IsWellFormedWhateverTheReportLacks) {
    for (const auto& [name, report] : reports()) {
        const Page page = read_page(cli::report_html(report));
        EXPECT_GT(page.tags.size(), 20u) << name;
        for (const std::string& fault : page.faults) ADD_FAILURE() << name << ": " << fault;
    }
}

TEST(ReportPage, LetsTextFromOutsideBeTextOnly) {
    const std::string html = cli::report_html(tests::sample_report());
    const Page page = read_page(html);
    for (const Tag& tag : page.tags) {
        EXPECT_NE(tag.name, "b") << "the hostile text became an element";
        for (const auto& [name, value] : tag.attributes) EXPECT_NE(name.substr(0, 2), "on") << value;
    }
    EXPECT_NE(page.text.find("&lt;/script&gt;&lt;b onclick=&#39;x&#39;&gt;&quot;&amp;amp; \u00FC\u6F22"),
              std::string::npos);
    EXPECT_EQ(html.find('\xFF'), std::string::npos) << "not UTF-8";
    EXPECT_NE(html.find("\uFFFD"), std::string::npos) << "what is not UTF-8 is shown as such";
    // One for the viewer's data, one a block of values (4 pictures, 3 with FLIP, 2 with steps), one for the
    // script.
    EXPECT_EQ(count(html, "</script>"), 1u + 4u + 3u + 2u + 1u);
}

TEST(ReportPage, AsksForNothing) {
    for (const auto& [name, report] : reports()) {
        const std::string html = cli::report_html(report);
        bool policy = false;
        for (const Tag& tag : read_page(html).tags) {
            for (const char* attribute :
                 {"src", "href", "srcset", "action", "data", "poster", "xlink:href"}) {
                const auto found = tag.attributes.find(attribute);
                if (found == tag.attributes.end()) continue;
                EXPECT_TRUE(found->second.starts_with("data:") || found->second.starts_with("#"))
                    << name << ": " << tag.name << " " << attribute << "=" << found->second.substr(0, 60);
            }
            const auto content = tag.attributes.find("content");
            if (content != tag.attributes.end()) policy |= content->second.starts_with("default-src 'none'");
        }
        EXPECT_TRUE(policy) << "the browser must be told, too";
    }
    for (const std::string_view part :
         {"http:", "https:", "url(", "@import", "import(", "fetch(", "XMLHttpRequest"}) {
        EXPECT_EQ(cli::report_style().find(part), std::string_view::npos) << part;
        EXPECT_EQ(cli::report_script().find(part), std::string_view::npos) << part;
        EXPECT_EQ(cli::report_viewer().find(part), std::string_view::npos) << part;
    }
    EXPECT_EQ(cli::report_script().find("</script"), std::string_view::npos) << "would end the script";
}

TEST(ReportPage, LinksLeadToPlacesInIt) {
    for (const auto& [name, report] : reports()) {
        std::set<std::string> places;
        const Page page = read_page(cli::report_html(report));
        for (const Tag& tag : page.tags) {
            const auto id = tag.attributes.find("id");
            if (id == tag.attributes.end()) continue;
            EXPECT_TRUE(places.insert(id->second).second) << id->second << " twice";
        }
        for (const Tag& tag : page.tags) {
            const auto href = tag.attributes.find("href");
            if (href == tag.attributes.end() || !href->second.starts_with("#")) continue;
            if (href->second.find('=') != std::string::npos) continue;  // A state of the viewer.
            EXPECT_TRUE(places.count(href->second.substr(1))) << name << ": " << href->second;
        }
    }
}

TEST(ReportPage, DrawsInsideItsFigures) {
    for (const auto& [name, report] : reports()) {
        double width = 0.0, height = 0.0;
        for (const Tag& tag : read_page(cli::report_html(report)).tags) {
            if (tag.name == "svg") {
                const std::string& box = tag.attributes.at("viewBox");
                char* end = nullptr;
                width = std::strtod(box.c_str() + 4, &end);
                height = std::strtod(end, nullptr);
            }
            for (const char* attribute :
                 {"x", "y", "x1", "y1", "cx", "cy", "r", "d", "points", "width", "height"}) {
                const auto found = tag.attributes.find(attribute);
                if (found == tag.attributes.end() || tag.name == "img") continue;
                std::string numbers = found->second;
                EXPECT_EQ(numbers.find("nan"), std::string::npos) << name << ": " << numbers;
                EXPECT_EQ(numbers.find("inf"), std::string::npos) << name << ": " << numbers;
                std::replace_if(
                    numbers.begin(), numbers.end(), [](char c) { return std::isalpha(c) || c == ','; }, ' ');
                const char* cursor = numbers.c_str();
                for (char* end = nullptr;; cursor = end) {
                    const double value = std::strtod(cursor, &end);
                    if (end == cursor) break;
                    EXPECT_GE(value, -1e-9)
                        << name << ": " << tag.name << " " << found->second.substr(0, 200);
                    EXPECT_LE(value, std::max(width, height))
                        << name << ": " << tag.name << " " << found->second.substr(0, 200);
                }
            }
        }
    }
}

TEST(ReportPage, StaysUnderTenMegabytesAndSaysWhatItLeftOut) {
    cli::Report report = tests::sample_report();
    report.width = 400;
    report.height = 300;
    report.pictures.clear();
    for (const char* name : {"reference", "fields 64", "fields 128", "fields 256", "triangles"})
        report.pictures.push_back(tests::noisy_picture(name, report.width, report.height,
                                                       static_cast<std::uint32_t>(report.pictures.size())));
    report.warnings.assign(5000, std::string(300, 'w'));
    const std::string html = cli::report_html(report);
    EXPECT_LE(html.size(), 10'000'000u);
    EXPECT_GT(html.size(), 6'000'000u) << "room for another picture was not used";
    EXPECT_EQ(count(html, "<img "), 5u * 4u) << "all pictures and maps are there as thumbnails";
    // The order of importance, not that of the report: the coarser fields go first.
    EXPECT_NE(html.find("id=\"values-0-radiance\""), std::string::npos) << "the reference";
    EXPECT_NE(html.find("id=\"values-4-radiance\""), std::string::npos) << "triangles";
    EXPECT_NE(html.find("id=\"values-3-radiance\""), std::string::npos) << "fields 256";
    EXPECT_EQ(html.find("id=\"values-1-radiance\""), std::string::npos) << "fields 64";
    EXPECT_EQ(html.find("id=\"values-2-radiance\""), std::string::npos) << "fields 128";
    EXPECT_NE(html.find("thumbnails only; their exact values are in the EXR files of this folder: fields 64, "
                        "fields 128."),
              std::string::npos);
    EXPECT_NE(html.find("and 4,950 more in report.json"), std::string::npos);
}

TEST(ReportPage, HoldsEachPictureExactlyWhereTheyFit) {
    const std::string html = cli::report_html(tests::sample_report());
    EXPECT_EQ(count(html, "\"exact\":true"), 4u);
    EXPECT_EQ(html.find("these are here as thumbnails only"), std::string::npos);
}

TEST(ReportPage, TellsEachCommandOnceAndEachPointInAllFigures) {
    const cli::Report report = tests::sample_report();
    const std::string html = cli::report_html(report);
    EXPECT_EQ(count(html, "id=\"run-0-"), 6u);
    EXPECT_EQ(count(html, "<code>fieldlight render room.glb --spp 16</code>"), 2u)
        << "one a series with 16 samples";
    // In the table and in each of four figures, where it has an error; the last of fields 128 has none.
    EXPECT_EQ(count(html, "href=\"#run-0-5\""), 5u);
    EXPECT_EQ(count(html, "href=\"#run-2-5\""), 1u);
}

TEST(ReportPage, NamesNoWinnerWhereIntervalsOverlap) {
    cli::Report report = tests::sample_report();
    report.series.resize(2);
    for (cli::ReportSeries& series : report.series) {
        series.floor = series.variance_seconds = series.rel_mse_at_equal_time = {};
        series.seconds_to_5_percent = cli::Estimate{1.0, 0.8, 1.2};
    }
    EXPECT_EQ(count(cli::report_html(report), " best\""), 0u);
    report.series[1].seconds_to_5_percent = cli::Estimate{2.0, 1.3, 2.6};
    EXPECT_EQ(count(cli::report_html(report), " best\""), 1u);
}

TEST(ReportPage, MarksTheWinnerOfThePairsAndSaysHowTheyAreDecided) {
    cli::Report report = tests::sample_report();
    for (cli::ReportSeries& series : report.series) {
        series.floor = series.variance_seconds = series.seconds_to_5_percent = {};
    }
    EXPECT_EQ(count(cli::report_html(report), " best\""), 0u) << "overlapping or not: pairs decide";
    report.winner = "triangles";
    const std::string html = cli::report_html(report);
    EXPECT_EQ(count(html, " best\""), 1u);
    EXPECT_NE(html.find("<dt>Paired, winner</dt>"), std::string::npos);
    EXPECT_EQ(count(html, "paired 95 % intervals"), 1u);
    report.paired.clear();
    EXPECT_EQ(count(cli::report_html(report), "paired 95 % intervals"), 0u);
}

TEST(ReportPage, ShowsSeedsMemoryAndWhatTheReferenceCost) {
    cli::Report report = tests::sample_report();
    std::string html = cli::report_html(report);
    EXPECT_NE(html.find("<dt>Seed of the reference</dt><dd>1000010</dd>"), std::string::npos);
    EXPECT_NE(html.find("<dt>Most memory held</dt><dd>765 MB</dd>"), std::string::npos);
    EXPECT_NE(html.find("4,096 samples a pixel, 91.5 s<"), std::string::npos);
    EXPECT_EQ(count(html, ">7016<"), 2u) << "one a series with 16 samples";
    report.reference_reused = true;
    report.reference_seconds = 0.0;
    EXPECT_NE(cli::report_html(report).find("reused from an earlier run, which did not record its time"),
              std::string::npos);
    report.reference_render_seconds = 91.5;
    EXPECT_NE(cli::report_html(report).find("91.5 s in an earlier run, reused"), std::string::npos);
}

/// Heights of the names at the ends of the lines, ascending.
std::vector<double> label_heights(const std::string& svg) {
    std::vector<double> heights;
    for (std::size_t at = svg.find("class=\"leader"); at != std::string::npos;
         at = svg.find("class=\"leader", at + 1)) {
        heights.push_back(std::strtod(svg.c_str() + svg.find(" y=\"", at) + 4, nullptr));
    }
    std::sort(heights.begin(), heights.end());
    return heights;
}

TEST(ErrorPlot, KeepsItsLabelsApart) {
    // Lines that end in one place: few have two lines of text each, many one, and all stay in the figure.
    for (const auto& [count, apart] : {std::pair{2u, 33.9}, {6u, 33.9}, {15u, 16.9}, {25u, 14.0}}) {
        cli::Report report = tests::sample_report();
        report.series.assign(count, report.series[2]);
        for (const cli::CostAxis axis : {cli::CostAxis::kWarm, cli::CostAxis::kRays}) {
            const std::vector<double> heights = label_heights(cli::error_plot(report, axis));
            ASSERT_EQ(heights.size(), count);
            for (std::size_t i = 1; i < count; ++i) EXPECT_GE(heights[i] - heights[i - 1], apart) << count;
            EXPECT_GT(heights.front(), 10.0);
            EXPECT_LT(heights.back(), 410.0);
        }
    }
}

TEST(ErrorPlot, IsEmptyWithoutPoints) {
    EXPECT_EQ(cli::error_plot({}, cli::CostAxis::kWarm), "");
    EXPECT_EQ(cli::error_plot(reports()["no points"], cli::CostAxis::kWarm), "");
}

TEST(ErrorPlot, ShiftsTheFitByWhatColdAdds) {
    // Two axes of the same picture: a cold point lies right of the warm one.
    cli::Report report = tests::sample_report();
    report.series.resize(1);
    EXPECT_NE(cli::error_plot(report, cli::CostAxis::kWarm), cli::error_plot(report, cli::CostAxis::kCold));
    EXPECT_EQ(count(cli::error_plot(report, cli::CostAxis::kWarm), "class=\"fit\""), 1u);
    EXPECT_EQ(count(cli::error_plot(report, cli::CostAxis::kCold), "class=\"fit\""), 1u);
    EXPECT_EQ(count(cli::error_plot(report, cli::CostAxis::kRays), "class=\"fit\""), 0u)
        << "the fit is over wall time";
    EXPECT_EQ(count(cli::error_plot(report, cli::CostAxis::kRays), "class=\"path\""), 1u);
}

}  // namespace
