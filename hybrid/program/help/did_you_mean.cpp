// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/help/did_you_mean.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>

#include "hybrid/base/file_ending.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {
namespace {

// The most similar name; empty if none is similar.
std::string nearest(const std::string& word, const std::vector<std::string>& names) {
  const std::vector<std::string_view> views(names.begin(), names.end());
  const std::string_view found = nearest_name(word, views);
  const bool alike = 3 * edit_distance(word, found) <= std::max(word.size(), found.size()) + 1;
  return alike ? std::string(found) : std::string();
}

}  // namespace

std::string unknown_name(const std::string& name, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return {};
  const std::string meant = nearest(name, known);
  std::string text = "unknown name '" + name + "'";
  if (!meant.empty()) text += ", did you mean '" + meant + "'?";
  text += meant.empty() ? "; known are " : " Known are ";
  for (const std::string& one : known) text += (&one == &known.front() ? "" : ", ") + one;
  return text;
}

std::string did_you_mean(const CLI::App& app, const std::vector<std::string>& arguments) {
  if (arguments.empty()) return {};
  const CLI::App* chosen = nullptr;
  std::vector<std::string> commands;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(sub->get_name());
    if (sub->get_name() == arguments.front()) chosen = sub;
  }
  if (chosen != nullptr && arguments.size() > 1) {
    std::vector<std::string> parts;
    for (const CLI::App* sub : chosen->get_subcommands([](const CLI::App*) { return true; })) {
      parts.push_back(sub->get_name());
      if (sub->get_name() == arguments[1]) chosen = sub;
    }
    const std::string part = parts.empty() ? std::string() : nearest(arguments[1], parts);
    if (!part.empty() && part != arguments[1])
      return "did you mean `" + arguments.front() + " " + part + "`?\n";
  }
  if (chosen == nullptr) {
    const std::string& word = arguments.front();
    if (lower_ending(word) == ".toml") return "did you mean `hybrid run " + word + "`?\n";
    const std::string command = word.starts_with("-") ? std::string() : nearest(word, commands);
    return command.empty() ? std::string() : "did you mean `" + command + "`?\n";
  }
  std::vector<std::string> options;
  for (const CLI::Option* option : chosen->get_options([](const CLI::Option*) { return true; })) {
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  }
  for (auto word = arguments.begin() + 1; word != arguments.end(); ++word) {
    const std::string name = word->substr(0, word->find('='));
    if (!name.starts_with("--") || std::find(options.begin(), options.end(), name) != options.end()) continue;
    const std::string option = nearest(name, options);
    if (!option.empty()) return "did you mean `" + option + "`?\n";
  }
  return {};
}

}  // namespace hybrid
