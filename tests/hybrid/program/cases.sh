#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# cases.sh PROGRAM CASES FOLDER: small files that are easily read wrong, each with its right value. CASES is the folder
# `cases` of the shared data. Without the folder the test is skipped, or fails if HYBRID_EXPECT_DATA is set.
set -u
program=$1 cases=$2 folder=$3
failures=0
if [ ! -d "$cases" ]; then
  echo "the shared data are not beside this checkout (HYBRID_SHARED_DATA names another place)"
  [ -n "${HYBRID_EXPECT_DATA:-}" ] && exit 1
  exit 77
fi
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1

# says NAME WORDS COMMAND...: the program must print the words (an extended regular expression).
says() {
  local name=$1 words=$2
  shift 2
  "$program" "$@" > log 2>&1
  tr '\n' ' ' < log | grep -qE "$words" && return
  echo "FAILED: $name: '$words' is not in:"
  cat log
  failures=$((failures + 1))
}
# is_not NAME WORDS: the last command must not have printed the words.
is_not() {
  tr '\n' ' ' < log | grep -qE "$2" || return
  echo "FAILED: $1: '$2' is in:"
  cat log
  failures=$((failures + 1))
}
# path_of FILE NAME [SED]: writes a scene of a table whose top is at z = 0. The path has the rows of FILE after SED.
path_of() {
  sed -e "${3:-}" "$1" > "$2.csv"
  printf 'format = 1\nunits = "mm"\n[device]\nmodel = "ideal"\n[[rigid]]\nname = "table"\nprimitive = "box"
size = [200, 200, 20]\nposition = [0, 0, -10]\n[path]\nkind = "csv"\nfile = "%s.csv"\n' "$2" > "$2.toml"
}
# follows FILE NAME [SED]: expects a path of 2 s that goes down at x = 10, y = 20 mm and presses with 7 N. The session
# takes half a second more.
follows() {
  path_of "$@"
  says "path $2" '^2500 ticks of 1 ms \(2\.50 s\).* force at most 7\.000 N' run "$2.toml" --samples 0 --trace "$2-t.csv"
  awk -F, 'NR > 1 && ($2 != 0.01 || $3 != 0.02) { bad = 1 } END { exit bad }' "$2-t.csv" ||
    { echo "FAILED: path $2: x and y are not 10 and 20 mm"; failures=$((failures + 1)); }
}

traj=$cases/traj
says "a first time that is not 0" "its first time, 5 s, is taken as 0" check "$traj/first.toml"
path_of "$traj/first.csv" first-negative '2,$s/^\([5-7]\)/-\1/'
says "times that go back" "first-negative\.csv:3: time runs backwards" check first-negative.toml
path_of "$traj/first.csv" first-late '2,$s/^/8640/'
says "a first time after a day" "its first time, 8\.64e\+04 s, is taken as 0" check first-late.toml
follows "$traj/ok.csv" ok
follows "$traj/brackets.csv" brackets
follows "$traj/brackets.csv" slashes '1s/.*/time\/ms,x\/m,y\/m,z\/m/'
follows "$traj/brackets.csv" upper '1s/.*/TIME [MSEC],X [M],Y [M],Z [M]/'
follows "$traj/parens.csv" parens
follows "$traj/parens.csv" underscores '1s/.*/Time_msec,X_metre,Y_metre,Z_metre/'
follows "$traj/yaw.csv" yaw
follows "$traj/yaw.csv" quaternion '1s/roll,pitch,yaw/qx,qy,qz/'
follows "$traj/yaw.csv" forces '1s/roll,pitch,yaw/fx_N,fy_N,fz_N/'
follows "$traj/velfirst.csv" velfirst
follows "$traj/velfirst.csv" speeds '1s/xvel_mm,yvel_mm,zvel_mm/vx_mm_s,vy_mm_s,vz_mm_s/'
follows "$traj/epoch_ns_nounit.csv" epoch
follows "$traj/timens.csv" nanoseconds
follows "$traj/epoch_ns_nounit.csv" epoch-ms '2,$s/^\([0-9]*\)000000,/\1,/'
follows "$traj/semi.csv" semicolons
follows "$traj/semi.csv" decimal-commas 's/\./,/g'
follows "$traj/semi.csv" tabs 's/;/\t/g'
path_of "$traj/ok.csv" more-fields '5s/$/,1/'
says "a row with more fields than names" "more-fields\.csv:5: 5 columns where 4 are named" run more-fields.toml
follows "$traj/ok.csv" quotes '1s/[a-z_]*/"&"/g;1s/""//g'

for file in ok semi thousand; do
  says "measured $file" "RMS force error over all ticks, in contact or not: 0\.1001 N" \
    compare "$cases/measured/s.toml" --measured "$cases/measured/$file.csv"
done

# label_2 FILE: label 2 of the volume has its middle at (-7, 11, 37) mm.
printf '1,liver\n2,femur\n3,spleen\n' > names.csv
label_2() {
  rm -rf composed
  says "label 2 of $1" "femur lies in x -9\.[0-9]* to -4\.[0-9]*, y 4\.[0-9]* to 17\.[0-9]*, z 32\.[0-9]* to 41\.[0-9]* mm" \
    compose --labels "$1" --names names.csv --out composed
}
two_mm=' 12 x 10 x 8 [a-z0-9]+, 2 x 2 x 2 mm'
volumes=$cases/volumes
export LC_ALL=C # because sed changes headers in files with binary data
label_2 "$volumes/base.nii.gz"
label_2 "$volumes/n_LAS.nrrd"
sed 's/^space: .*/space: LAS/' "$volumes/n_LAS.nrrd" > short.nrrd
label_2 short.nrrd
sed 's/^space: .*/space: LEFT-anterior-superior/' "$volumes/n_LAS.nrrd" > case.nrrd
label_2 case.nrrd
for space in scanner-xyz 3D-right-handed somewhere; do
  sed "s/^space: .*/space: $space/" "$volumes/n_scanner.nrrd" > "$space.nrrd"
done
for space in scanner-xyz 3D-right-handed; do
  says "space $space" "anatomical directions are unknown" check "$space.nrrd"
done
says "a space that is none" "refused.*'somewhere' is none of NRRD's" check somewhere.nrrd
says "NRRD in um" "$two_mm" check "$volumes/n_um.nrrd"
sed 's/^space units: .*/space units: "microns" "microns" "microns"/' "$volumes/n_um.nrrd" > microns.nrrd
says "NRRD in microns" "$two_mm" check microns.nrrd
sed 's/^space units: .*/space units: "in" "in" "in"/' "$volumes/n_um.nrrd" > inches.nrrd
says "NRRD in inches" "5\.08e\+04 x 5\.08e\+04 x 5\.08e\+04 mm" check inches.nrrd
says "NIfTI in metres" "$two_mm" check "$volumes/units_metre.nii"
label_2 "$volumes/units_metre.nii"

# byte FILE AT VALUE: sets a byte of a file.
byte() { printf "\\x$3" | dd of="$1" bs=1 seek="$2" conv=notrunc 2> /dev/null; }
cp "$volumes/units_metre.nii" microns.nii
byte microns.nii 123 03 # xyzt_units
says "NIfTI in microns" "2e-06 x 2e-06 x 2e-06 mm" check microns.nii
says "a slope of 0" "$two_mm, 0 to 3, 4 labels" check "$volumes/slope0_inter5.nii"
cp "$volumes/slope0_inter5.nii" slope1.nii
byte slope1.nii 114 80 # sets scl_slope to 1, so that the intercept counts
byte slope1.nii 115 3f
says "a slope of 1" "$two_mm, 5 to 8" check slope1.nii
says "neither qform nor sform" "anatomical directions are unknown" check "$volumes/both_codes0.nii"
cp "$volumes/both_codes0.nii" qform.nii
byte qform.nii 252 01
says "qform alone" "$two_mm" check qform.nii
is_not "qform alone" "unknown"
says "ElementSize" "$two_mm" check "$volumes/m_elementsize.mha"
is_not "ElementSize" "spacing"
sed '/^ElementSize /d' "$volumes/m_elementsize.mha" > no_size.mha
says "neither ElementSize nor ElementSpacing" "1 x 1 x 1 mm.*spacing" check no_size.mha

dicom=$cases/dicom
for series in plain enh_slopes enh_desc be32 icon_undef; do
  says "DICOM $series" "$two_mm, 0 to 300;" check "$dicom/$series"
done
says "DICOM: two times" "refused.*more than one volume" check "$dicom/enh4d_tk"
says "DICOM: one slice" "12 x 10 x 1 [a-z0-9]+, 0\.7 x 0\.7 x 5 mm" check "$dicom/one5"
mkdir gap
cp "$dicom"/plain/* gap
rm gap/IM0003
says "DICOM: a slice is missing" "refused.*slices are missing" check gap
mkdir preamble
for slice in "$dicom"/plain/*; do tail -c +133 "$slice" > "preamble/${slice##*/}"; done
says "DICOM without preambles" "$two_mm, 0 to 300;" check preamble

meshes=$cases/meshes
cp "$meshes/L1.obj" .
cp "$meshes/s_L1_obj.toml" notch.toml
says "a notch" "force at most 0\.000 N" run notch.toml
awk '$1 == "f" { printf "f"; for (i = 3; i <= NF; ++i) printf " %s", $i; print " " $2; next } { print }' \
  "$meshes/L1.obj" > L1.obj
says "a notch, from the next corner" "force at most 0\.000 N" run notch.toml
awk '$1 == "f" { printf "f"; for (i = 4; i <= NF; ++i) printf " %s", $i; print " " $2 " " $3; next } { print }' \
  "$meshes/L1.obj" > L1.obj
says "a notch, from the corner after that" "force at most 0\.000 N" run notch.toml
cube="8 vertices, 12 triangles, 10 x 10 x 10 mm.* a closed solid"
for file in base.obj bom.obj bom.ply; do says "$file" "$cube" check "$meshes/$file"; done
tr '\n' '\r' < "$meshes/base.obj" > cr.obj
says "lines that end in CR" "$cube" check cr.obj
sed 's/$/\r/' "$meshes/bom.obj" > crlf.obj
says "a byte-order mark and CRLF" "$cube" check crlf.obj
tr '\n' '\r' < "$meshes/bom.ply" > cr.ply
says "a PLY whose lines end in CR" "$cube" check cr.ply
for file in lfs.stl pointer.obj pointer.ply; do
  cp "$meshes/lfs.stl" "$file"
  says "$file" "Git LFS pointer" check "$file"
done

# names FILE WORDS: `compose` with this file of names must print the words.
names() {
  rm -rf composed
  says "names $1" "$2" compose --labels "$volumes/base.nii.gz" --names "$1" --out composed
}
tables=$cases/names
names "$tables/bone_bom.csv" "femur_left +rigid +108"
names "$tables/bone_itksnap.txt" "femur_left +rigid +108"
{ printf 'index\tname\n'; tail -c +4 "$tables/bone_bom.csv" | tr ',' '\t'; } > bids.tsv
names bids.tsv "femur_left +rigid +108"
printf '# FreeSurfer\n0 Unknown 0 0 0 0\n1 Left-Femur 1 2 3 0\n2 liver 4 5 6 0\n3 spleen 7 8 9 0\n' > lut.txt
names lut.txt "[Ll]eft.[Ff]emur +rigid +108"
names "$tables/nnunet.json" "rib_left_5 +rigid +48"
names "$tables/slicer.ctbl" "rib_left_5 +rigid +48"
printf '{"labels":{"liver":[1],"rib_left_5":"2","spleen":3}}' > regions.json
names regions.json "rib_left_5 +rigid +48"
names "$tables/latin1.csv" "latin1\.csv:1: is not UTF-8 text .*save it as UTF-8"
iconv -f WINDOWS-1252 -t UTF-8 "$tables/latin1.csv" > utf8.csv
names utf8.csv "Leber"
iconv -f WINDOWS-1252 -t UTF-16 "$tables/latin1.csv" > utf16.csv
names utf16.csv "utf16\.csv: is UTF-16 text; save it as UTF-8"

# held TRACE FROM_S TO_S LEAST_N MOST_N NAME: the mean force must be in the range, and no tick below half of the mean.
held() {
  awk -F, -v a="$2" -v b="$3" -v least="$4" -v most="$5" '
    NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
    $at["t_s"] >= a && $at["t_s"] <= b { f = sqrt($at["force_x_N"]^2 + $at["force_y_N"]^2 + $at["force_z_N"]^2)
      ++n; sum += f; if (f < least / 2) { print f " N at " $at["t_s"] " s"; bad = 1 } }
    END { mean = n ? sum / n : 0; if (bad || mean < least || mean > most) { print "mean " mean " N of " n " ticks"; exit 1 } }
    ' "$1" && return
  echo "FAILED: $6"
  failures=$((failures + 1))
}
tissue=$cases/tissue
# press NAME FROM_S TO_S LEAST_N MOST_N: plays NAME.toml and checks the held force. In gel10 this force must stay until
# the tool leaves, at any spacing and radius.
press() {
  says "$1" "ticks of 1 ms" run "$1.toml" --samples 0 --trace "$1.csv"
  held "$1.csv" "$2" "$3" "$4" "$5" "$1: the held force"
}
cp "$tissue/gel10.toml" gel10.toml
press gel10 0.9 1.75 1.05 1.25
sed 's/^spacing = 2/spacing = 1/' "$tissue/gel10.toml" > fine.toml
press fine 0.9 1.75 0.85 0.91
{ cat "$tissue/gel10.toml"; printf '[tool]\nradius = 3\n'; } > wide.toml
press wide 0.9 1.75 1.3 1.45
# st2: the held force is the same wherever the session begins, also inside the tissue.
for from in 6 9 14; do
  sed "s/^from=.*/from=[0,0,$from]/" "$tissue/st2.toml" > "from$from.toml"
  start=$(awk -v z="$from" 'BEGIN { print (z > 4 ? z - 4 : 4 - z) / 20 }') # speed 20 mm/s
  press "from$from" "$(awk -v a="$start" 'BEGIN { print a + 0.4 }')" "$(awk -v a="$start" 'BEGIN { print a + 0.95 }')" 0.36 0.378
  grep -q "forces by object are those before the limits" log || [ "$from" = 14 ] ||
    { echo "FAILED: from$from: the object's force, cut by the soft start, is said to be felt"; failures=$((failures + 1)); }
done

[ "$failures" = 0 ] && echo "all cases are right"
exit "$failures"
