// cli/gather_flags.h: the flags of the gather; shared by the verbs that make or plan its pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "gather/plan.h"
#include "gather/settings.h"

namespace cli {

/// Of --accumulate.
inline constexpr int kMostFrames = 1 << 16;

class GatherFlags {
public:
    /// Declares --quality, --set, --bounces and --help-settings: how a picture is made, but for how many
    /// frames it takes.
    void add_settings_to(CLI::App& verb);

    /// These, --accumulate and --effects.
    void add_to(CLI::App& verb);

    /// Those given of which another renderer knows nothing: all but --bounces.
    std::vector<std::string> given() const;

    bool frames_given() const { return frames_.has_value(); }
    std::optional<int> bounces() const { return bounces_; }

    /// @throws core::InputError (kUsage)
    gather::Settings settings() const;
    gather::EffectRequest effects() const { return gather::parse_effects(effects_); }

private:
    std::string quality_ = "medium";
    std::vector<std::string> settings_;
    std::optional<int> frames_;
    std::optional<int> bounces_;
    std::string effects_ = "auto";
    std::vector<const CLI::Option*> own_;
};

}  // namespace cli
