// SPDX-License-Identifier: GPL-3.0-or-later
// The manual page, from the same descriptions as the help. Macros and sections: man(7), man-pages(7).
#include <CLI/CLI.hpp>
#include <sstream>

#include "hybrid/program/help/program_pages.h"

namespace hybrid {
namespace {

// Text as roff prints it: '\' begins an escape, '-' would become a hyphen that cannot be pasted into a shell,
// and '.' or ''' at the beginning of a line would be a request. A line may be broken after the commas of a
// set.
std::string roff(const std::string& text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == ',')
      out += ",\\:";
    else
      out += c;
    line_begins = c == '\n';
  }
  return out;
}

// Prints paragraphs. Indented lines are examples and stay as they are.
void print_text(std::ostream& page, const std::string& text) {
  std::istringstream lines(text);
  bool in_example = false;
  for (std::string line; std::getline(lines, line);) {
    const bool is_example = line.starts_with("  ");
    if (is_example != in_example) page << (is_example ? ".PP\n.nf\n.RS 4\n" : ".RE\n.fi\n.PP\n");
    in_example = is_example;
    if (line.empty())
      page << ".PP\n";
    else
      page << roff(is_example ? line.substr(2) : line) << '\n';
  }
  if (in_example) page << ".RE\n.fi\n";
}

// The values that an option or argument takes, as in its help: "INT in [0 - 1000000]", "{quick,full}".
std::string option_values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t set = type.find('{');
  if (set != std::string::npos) return type.substr(set, type.find('}') - set + 1);
  const std::size_t range = type.find(" in [");
  const std::string kind = type.substr(0, type.find(':'));
  return range == std::string::npos ? kind : kind + type.substr(range);
}

std::string option_names(const CLI::Option& option) {
  std::string out;
  for (const std::string& name : option.get_snames()) out += (out.empty() ? "-" : ", -") + name;
  for (const std::string& name : option.get_lnames()) out += (out.empty() ? "--" : ", --") + name;
  return out;
}

void print_option(std::ostream& page, const CLI::Option& option) {
  page << ".TP\n";
  if (option.get_positional()) {
    page << "\\fI" << roff(option.get_name(true)) << "\\fR";
    if (option.get_type_name().find('{') != std::string::npos) page << ' ' << roff(option_values(option));
  } else {
    page << "\\fB" << roff(option_names(option)) << "\\fR";
    if (option.get_items_expected_max() > 0) page << " \\fI" << roff(option_values(option)) << "\\fR";
  }
  page << '\n' << roff(option.get_description());
  if (!option.get_default_str().empty()) page << "; default: " << roff(option.get_default_str());
  if (option.get_required() && !option.get_positional()) page << " (required)";
  page << '\n';
}

void print_options(std::ostream& page, const CLI::App& app) {
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
      const bool is_help = app.get_parent() != nullptr && option == app.get_help_ptr();  // listed once
      if (option->get_positional() == positional && !is_help) print_option(page, *option);
    }
  }
}

std::string synopsis(const CLI::App& app, const std::string& name) {
  std::string line = "\\fB" + roff(name) + "\\fR [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option :
       app.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string word = option->get_name(true) + (option->get_items_expected_max() > 1 ? "..." : "");
    line += option->get_required() ? " \\fI" + word + "\\fR" : " [\\fI" + word + "\\fR]";
  }
  return line;
}

void print_command(std::ostream& page, const CLI::App& app, const std::string& above) {
  const std::string name = above + ' ' + app.get_name();
  page << ".SS " << roff(name) << '\n' << synopsis(app, name) << "\n.PP\n";
  print_text(page, app.get_description());
  print_options(page, app);
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    print_command(page, *sub, name);
  }
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& version) {
  std::ostringstream page;
  // Turns adjustment and hyphenation off, so that options and names of files stay whole.
  page << ".TH HYBRID 1 \"\" \"hybrid " << version << "\" \"User Commands\"\n.nh\n.ad l\n";
  page << ".SH NAME\nhybrid \\- haptic renderer for scenes of rigid and soft objects\n";
  page << ".SH SYNOPSIS\n\\fBhybrid\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR] [\\fIFILES\\fR]\n";
  page << ".SH DESCRIPTION\n";
  print_text(page, app.get_description());
  page << ".SH OPTIONS\n";
  print_options(page, app);
  page << ".SH COMMANDS\n";
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    print_command(page, *sub, "hybrid");
  }
  page << ".SH FILES\n.TP\n\\fI/usr/share/hybrid/scenes\\fR\n"
       << "scenes to begin from, and README.md, which describes every key; "
       << "where the program was installed elsewhere, share/hybrid/scenes of that prefix\n";
  return page.str();
}

}  // namespace hybrid
