// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/tissue_table.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace hybrid {
namespace {

constexpr std::string_view kArda = "shear-wave elastography, Arda et al. 2011, AJR 197:532";
constexpr std::string_view kLim =
    "shear modulus 0.64 kPa of the stomach, Lim et al. 2009, Surg Endosc 23:1298";

constexpr Tissue bone(std::string_view name, std::string_view patterns) {
  return {name, patterns, true, 0.0, 0.0, true, "rigid", {0.91F, 0.87F, 0.75F}};
}

constexpr std::array kTissues{
    // clang-format off
    // These rows come before those of bones, because the patterns of bones also fit these names.
    Tissue{"cartilage", "*cartilage* *menisc* *disc *intervertebral*", false, 7.0e5, 0.10, true,
           "human femoral condyle, aggregate modulus 0.70 MPa, Athanasiou et al. 1991, J Orthop Res 9:330", {0.76F, 0.86F, 0.90F}},
    Tissue{"spinal cord", "*spinal_cord* *spinal?cord* *medulla_spinalis*", false, 2.5e3, 0.45, false,
           "as the brain's", {0.93F, 0.86F, 0.55F}},
    bone("rib", "rib rib_* ribs* *_rib *_rib_* *_ribs"),
    bone("vertebra", "vertebra* *_vertebra* *vertebrae"),
    bone("sacrum", "sacrum* *coccyx*"),
    bone("hip", "hip hip_* *_hip pelvis pelvis_left pelvis_right left_pelvis right_pelvis *pelvic_bone* *ilium* *ischium*"),
    bone("femur", "femur* *_femur*"),
    bone("humerus", "humerus* *_humerus*"),
    bone("scapula", "scapula* *_scapula*"),
    bone("clavicle", "clavicula* *_clavicula* clavicle* *_clavicle*"),
    bone("sternum", "sternum*"),
    bone("skull", "skull* *_skull* *cranium* *mandible* *maxilla*"),
    bone("bone", "*bone* *tibia* *fibula* *patella* *radius* *ulna* *carpal* *tarsal* *phalan* talus* *_talus* calcaneus* *_calcaneus* "
         "*teeth* *tooth*"),
    // Vessels come before the organs that they are named after.
    Tissue{"vessel", "*aorta* *artery* *arteri* *vein* *vena* *cava* *vessel* *trunk*", false, 1.0e5, 0.45, false,
           "a wall around blood: order of the aorta's pressure-strain modulus, 100 kPa", {0.80F, 0.15F, 0.15F}},
    Tissue{"liver", "*liver* *hepat*", false, 5.5e3, 0.45, true,
           "healthy adults, transient elastography, Roulot et al. 2008, J Hepatol 48:606", {0.46F, 0.20F, 0.15F}},
    Tissue{"spleen", "*spleen* *splen*", false, 2.9e3, 0.45, true, kArda, {0.47F, 0.24F, 0.35F}},
    Tissue{"kidney", "*kidney* *renal_cortex*", false, 5.0e3, 0.45, true, kArda, {0.62F, 0.28F, 0.20F}},
    Tissue{"pancreas", "*pancreas*", false, 4.8e3, 0.45, true, kArda, {0.90F, 0.74F, 0.52F}},
    Tissue{"thyroid", "*thyroid*", false, 1.1e4, 0.45, true, kArda, {0.72F, 0.38F, 0.34F}},
    Tissue{"gland", "*adrenal* *gland* *prostate* *thymus*", false, 5.0e3, 0.45, false,
           "no figure found; as the kidney's", {0.84F, 0.66F, 0.46F}},
    Tissue{"stomach", "*stomach*", false, 1.9e3, 0.45, true, kLim, {0.88F, 0.62F, 0.56F}},
    Tissue{"bowel", "*bowel* *colon* *duodenum* *intestin* *rectum* *esophagus* *oesophagus*", false, 1.9e3, 0.45,
           false, "as the stomach's", {0.82F, 0.58F, 0.46F}},
    Tissue{"bladder", "*bladder*", false, 1.9e3, 0.45, false, "a wall around fluid; as the stomach's", {0.90F, 0.82F, 0.52F}},
    Tissue{"lung", "*lung*", false, 1.0e3, 0.43, true,
           "inflated dog lobes, E = 2 P by indentation, at P = 0.5 kPa, Lai-Fook et al. 1976, J Appl Physiol 40:508", {0.90F, 0.70F, 0.72F}},
    Tissue{"airway", "*trachea* *bronch*", false, 1.0e5, 0.30, false, "no figure for a filled label; between vessel and cartilage", {0.66F, 0.80F, 0.84F}},
    Tissue{"heart", "*heart* *atri* *ventricle_of_heart* *myocard*", false, 1.3e4, 0.45, true,
           "diastolic myocardium, shear modulus 4.5 kPa (2.6 to 6.1 with age), Villemain et al. 2019, JACC Cardiovasc Imaging 12:1135", {0.66F, 0.16F, 0.20F}},
    Tissue{"muscle", "*muscle* *muscul* *gluteus* *autochthon* *psoas* *erector* *quadriceps* *biceps* *rectus* "
           "*oblique*", false, 1.11e4, 0.45, true, kArda, {0.70F, 0.27F, 0.24F}},
    Tissue{"skin", "*skin* *dermis* *cutis", false, 1.0e5, 0.45, true,
           "forearm, optical coherence elastography, Liang & Boppart 2010, IEEE Trans Biomed Eng 57:953", {0.93F, 0.77F, 0.66F}},
    Tissue{"fat", "*fat *fat_* *adipos* *subcutaneous*", false, 3.25e3, 0.45, true,
           "breast fat, Samani et al. 2007, Phys Med Biol 52:1565", {0.96F, 0.85F, 0.48F}},
    Tissue{"brain", "*brain* *cerebr* *cerebell* *cortex* *gyrus* *thalam* *white_matter* *grey_matter* *gray_matter*",
           false, 2.5e3, 0.45, true, "shear modulus 0.84 kPa, Miller & Chinzei 2002, J Biomech 35:483", {0.88F, 0.71F, 0.68F}},
    // clang-format on
};

constexpr Tissue kUnknown{"tissue",
                          "",
                          false,
                          5.0e3,
                          0.45,
                          false,
                          "not in the table: 5 kPa, the middle of the organs that are",
                          {0.86F, 0.58F, 0.62F}};

char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// The words of a label's name with '_' between them: "Left-Femur", "left femur" and "LeftFemur" are one name.
std::string joined_words(std::string_view label_name) {
  std::string name;
  bool after_small = false;  // after a small letter
  for (const char c : label_name) {
    const auto byte = static_cast<unsigned char>(c);
    if (after_small && std::isupper(byte) != 0) name += '_';
    name += std::isalnum(byte) != 0 || byte >= 0x80U ? c : '_';
    after_small = std::islower(byte) != 0;
  }
  return name;
}

}  // namespace

LatticeStiffness as_six_links(const Tissue& tissue) {
  constexpr double kPoisson = 0.3;  // see tissue_table.h
  return {tissue.young_Pa * (1.0 - kPoisson * kPoisson) / (1.0 - tissue.poisson * tissue.poisson), kPoisson};
}

std::span<const Tissue> tissue_table() {
  return kTissues;
}

const Tissue& unknown_tissue() {
  return kUnknown;
}

bool fits_pattern(std::string_view name, std::string_view pattern) {
  // If the rest of the name does not fit, the last star takes one more character. Earlier stars need not be
  // tried again, so the number of steps is at most the product of both lengths.
  std::size_t n = 0, p = 0, star = std::string_view::npos, retry = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      retry = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || lower(pattern[p]) == lower(name[n]))) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++retry;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

const Tissue* find_tissue(std::string_view label_name) {
  const std::string name = joined_words(label_name);
  for (const Tissue& tissue : kTissues) {
    std::string_view rest = tissue.patterns;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      const std::string_view pattern = rest.substr(0, end);
      if (!pattern.empty() && fits_pattern(name, pattern)) return &tissue;
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  return nullptr;
}

}  // namespace hybrid
