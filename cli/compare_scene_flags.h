// cli/compare_scene_flags.h: the flags of `fieldlight compare SCENE`, beside those for two pictures.
#pragma once

#include <string>
#include <vector>

#include "cli/compare_scene.h"
#include "cli/gather_flags.h"

namespace cli {

/// What is typed, before it is understood.
class CompareSceneFlags {
public:
    /// Declares the flags, in a group of their own.
    void add_to(CLI::App& verb);

    /// The flags that were given, as typed: two pictures take none of them.
    std::vector<std::string> given() const;

    /// @throws core::InputError for values that cannot be meant
    CompareSceneOptions understand(const std::string& scene) const;

private:
    void understand_renderers(CompareSceneOptions& options) const;

    CompareSceneOptions options_;
    std::string size_ = "400x225";
    std::vector<std::string> renderers_ = {"path"};
    GatherFlags gather_;
    std::vector<const CLI::Option*> all_;
};

}  // namespace cli
