// SPDX-License-Identifier: GPL-3.0-or-later
// Completions for bash, from the program's own options. The generated function finds the command among the
// words before the cursor. Then it completes the value of the last option, or an option, or an argument.
#include <CLI/CLI.hpp>
#include <sstream>

#include "hybrid/program/help/program_pages.h"

namespace hybrid {
namespace {

// Functions that every completion uses. The last part of a list with commas is completed by itself. In
// --option=value bash takes the '=' as a separate word.
constexpr const char* kHead =
    R"(# Completions of the program hybrid, for bash. Written by `hybrid --bash-completion`.
_hybrid_words() {
  local word=$1 before=${1%"${1##*,}"}
  COMPREPLY=($(compgen -P "$before" -W "$2" -- "${word##*,}"))
}

_hybrid_files() {
  local line
  compopt -o filenames 2>/dev/null
  while IFS= read -r line; do COMPREPLY+=("$line"); done < <(compgen -d -- "$1"; compgen -f -X "!*$2" -- "$1")
}

_hybrid() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} context=hybrid at
  if [[ $before == = ]]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi
  if [[ $word == = ]]; then before=${COMP_WORDS[COMP_CWORD - 1]} word=; fi
  COMPREPLY=()
)";

constexpr const char* kEnd = R"(}
complete -F _hybrid hybrid
)";

struct Context {
  std::string words;  // the command: "hybrid bench compare"
  const CLI::App* app;
};

void list_contexts(const CLI::App& app, const std::string& words, std::vector<Context>& contexts) {
  contexts.push_back({words, &app});
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    list_contexts(*sub, words + ' ' + sub->get_name(), contexts);
  }
}

std::vector<const CLI::Option*> options_of(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* o) { return o->get_positional() == positional; });
}

// The set of values in the option's type, "{a,b}" or "{a->1,b->2}", separated by spaces. Empty if the type
// has no set.
std::string known_values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  std::istringstream set(type.substr(begin + 1, end - begin - 1));
  std::string out;
  for (std::string value; std::getline(set, value, ',');) {
    out += (out.empty() ? "" : " ") + value.substr(0, value.find("->"));
  }
  return out;
}

// The call that completes a value: one of a set, a file, or nothing for a number.
std::string completes(const CLI::Option& option, const std::string& ending) {
  const std::string known = known_values(option);
  if (!known.empty()) return "_hybrid_words \"$word\" '" + known + "'";
  return option.get_type_name().starts_with("TEXT") ? "_hybrid_files \"$word\" '" + ending + "'" : ":";
}

void print_contexts(std::ostream& script, const std::vector<Context>& contexts) {
  script << "  for ((at = 1; at < COMP_CWORD; ++at)); do\n    case \"$context ${COMP_WORDS[at]}\" in\n      ";
  for (std::size_t c = 1; c < contexts.size(); ++c)
    script << (c > 1 ? " | " : "") << '\'' << contexts[c].words << '\'';
  script << ") context+=\" ${COMP_WORDS[at]}\" ;;\n    esac\n  done\n";
}

void print_values(std::ostream& script, const std::vector<Context>& contexts) {
  script << "  case \"$context $before\" in\n";
  for (const Context& context : contexts) {
    for (const CLI::Option* option : options_of(*context.app, false)) {
      if (option->get_items_expected_max() == 0) continue;
      for (const std::string& name : option->get_lnames()) {
        script << "    '" << context.words << " --" << name << "') " << completes(*option, "")
               << "; return ;;\n";
      }
    }
  }
  script << "  esac\n";
}

std::string option_words(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : options_of(app, false)) {
    for (const std::string& name : option->get_lnames()) out += (out.empty() ? "--" : " --") + name;
  }
  return out;
}

// Arguments: commands, a known set, or files.
std::string completes_arguments(const CLI::App& app) {
  std::string words;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    words += (words.empty() ? "" : " ") + sub->get_name();
  }
  for (const CLI::Option* option : options_of(app, true)) {
    const std::string known = known_values(*option), name = option->get_name(true);
    if (known.empty() && words.empty())
      return completes(*option, name == "SCENE" ? ".toml" : name == "RECORDING" ? ".rec" : "");
    words += (words.empty() ? "" : " ") + known;
  }
  return words.empty() ? ":" : "_hybrid_words \"$word\" '" + words + "'";
}

void print_arguments(std::ostream& script, const std::vector<Context>& contexts) {
  script << "  case $context/$word in\n";
  for (const Context& context : contexts) {
    script << "    '" << context.words << "'/-*) _hybrid_words \"$word\" '" << option_words(*context.app)
           << "' ;;\n";
    script << "    '" << context.words << "'/*) " << completes_arguments(*context.app) << " ;;\n";
  }
  script << "  esac\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::vector<Context> contexts;
  list_contexts(app, "hybrid", contexts);
  std::ostringstream script;
  script << kHead;
  print_contexts(script, contexts);
  print_values(script, contexts);
  print_arguments(script, contexts);
  script << kEnd;
  return script.str();
}

}  // namespace hybrid
