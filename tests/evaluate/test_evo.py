"""The figures of evo 1.38.1 on its own test trajectories.

The numbers were printed by evo itself, in an environment of its own (``pip install evo==1.38.1``), with::

    evo_ape tum REFERENCE ESTIMATE -v --save_results r.zip              (-a for se3, -as for sim3, --align_origin)
    evo_ape tum REFERENCE ESTIMATE -r angle_rad --save_results r.zip
    evo_rpe tum REFERENCE ESTIMATE --delta 1 --delta_unit f --save_results r.zip       (also -r angle_rad)
    unzip -p r.zip stats.json

(kitti and euroc instead of tum by the names of the files), which gives all digits where the screen shows six.
"""

import pytest

from logpose.formats.trajectories.trajectory import read_trajectory
from logpose.pipelines.evaluate.evaluation import EvaluateParams, evaluate

# reference, estimate, alignment, step of the relative error, pairs, statistics
PAIRS = [
    ("KITTI_00_gt.txt", "KITTI_00_ORB.txt", "none", "1f", 4541, {
        "ate_m": {"rmse_m": 7.790288882656827, "mean_m": 7.01175040166684, "median_m": 6.801631674560281, "std_m": 3.3946954473076767, "max_m": 13.45850880738189, "sse_m2": 275586.9365744946},
        "ate_rad": {"rmse_rad": 0.02809209900464346, "mean_rad": 0.026846044735682965, "median_rad": 0.026503840986244483, "std_rad": 0.008273808587125956, "max_rad": 0.13851647926600827, "sse_rad2": 3.5836029262760603},
        "rpe_m": {"rmse_m": 0.02812037701739386, "mean_m": 0.019301310981393958, "median_m": 0.01470904343858892, "std_m": 0.020450305572286533, "max_m": 0.30271249059536337, "sse_m2": 3.590030440345692},
        "rpe_rad": {"rmse_rad": 0.0020066664985950735, "mean_rad": 0.0010399274681219656, "median_rad": 0.0007168836103531885, "std_rad": 0.001716176359710519, "max_rad": 0.03833817125118025, "sse_rad2": 0.018281265382090503},
    }),
    ("KITTI_00_gt.txt", "KITTI_00_SPTAM.txt", "none", "1f", 4541, {
        "ate_m": {"rmse_m": 9.224541737237876, "mean_m": 8.62370355518929, "median_m": 8.28232140962514, "std_m": 3.2747377382409044, "max_m": 14.911823227678537, "sse_m2": 386403.54515993985},
        "ate_rad": {"rmse_rad": 0.0420466732101748, "mean_rad": 0.03832355754193796, "median_rad": 0.03526709535844299, "std_rad": 0.017298198327369296, "max_rad": 0.19786294190834885, "sse_rad2": 8.028137108044314},
        "rpe_m": {"rmse_m": 0.03491936757324089, "mean_m": 0.023406450624852342, "median_m": 0.01915993677265607, "std_m": 0.025913322844850623, "max_m": 1.136073589515664, "sse_m2": 5.5359045319865885},
        "rpe_rad": {"rmse_rad": 0.0051729786341050054, "mean_rad": 0.004218747125314935, "median_rad": 0.0035084336737548428, "std_rad": 0.0029936400320602764, "max_rad": 0.043695281103748596, "sse_rad2": 0.12148907408803725},
    }),
    ("KITTI_00_gt.txt", "KITTI_00_ORB.txt", "se3", "1f", 4541, {
        "ate_m": {"rmse_m": 1.3034497145650337, "mean_m": 1.1569971285389835, "median_m": 1.0656247695557912, "std_m": 0.600282269396835, "max_m": 3.587949120678975, "sse_m2": 7715.07344029289},
        "ate_rad": {"rmse_rad": 0.013199934149812523, "mean_rad": 0.010760241256541955, "median_rad": 0.009213442396908253, "std_rad": 0.007645617676839414, "max_rad": 0.117854831735286, "sse_rad2": 0.7912159457411758},
        "rpe_m": {"rmse_m": 0.0281203770173941, "mean_m": 0.01930131098139454, "median_m": 0.014709043438546485, "std_m": 0.02045030557228631, "max_m": 0.302712490595413, "sse_m2": 3.5900304403457537},
        "rpe_rad": {"rmse_rad": 0.0020066664985950756, "mean_rad": 0.0010399274681219678, "median_rad": 0.0007168836103532456, "std_rad": 0.0017161763597105203, "max_rad": 0.03833817125118017, "sse_rad2": 0.018281265382090545},
    }),
    ("fr2_desk_groundtruth.txt", "fr2_desk_ORB.txt", "se3", "1f", 2174, {
        "ate_m": {"rmse_m": 0.008118977562044926, "mean_m": 0.0074917768702161495, "median_m": 0.007414629829316952, "std_m": 0.00312906950703932, "max_m": 0.024299593694385276, "sse_m2": 0.14330528992359803},
        "ate_rad": {"rmse_rad": 0.01726192865814985, "mean_rad": 0.01674596435994816, "median_rad": 0.016577158843191372, "std_rad": 0.00418889706896709, "max_rad": 0.03534066965609874, "sse_rad2": 0.6477958694919457},
        "rpe_m": {"rmse_m": 0.003490321374787286, "mean_m": 0.0030380874175009566, "median_m": 0.002750288386204113, "std_m": 0.0017182456584898971, "max_m": 0.019484678920167163, "sse_m2": 0.026472231989372402},
        "rpe_rad": {"rmse_rad": 0.00489598411351181, "mean_rad": 0.004006510104788863, "median_rad": 0.0032780504727434523, "std_rad": 0.0028139895557703783, "max_rad": 0.021980737733404084, "sse_rad2": 0.052088245135598545},
    }),
    ("fr2_desk_groundtruth.txt", "fr2_desk_ORB_kf_mono.txt", "sim3", "1f", 118, {
        "ate_m": {"rmse_m": 0.007729264783424068, "mean_m": 0.007103615951625619, "median_m": 0.007099822211333756, "std_m": 0.003046337884097819, "max_m": 0.015688557595242313, "sse_m2": 0.007049501022888982},
        "ate_rad": {"rmse_rad": 0.015691482943031992, "mean_rad": 0.015086715202222552, "median_rad": 0.014940765949488562, "std_rad": 0.004314355265678855, "max_rad": 0.023958409656674142, "sse_rad2": 0.02905427116027275},
        "rpe_m": {"rmse_m": 0.007069324681400337, "mean_m": 0.005698826112083059, "median_m": 0.0049311943208374415, "std_m": 0.004183148622185956, "max_m": 0.03590258375153949, "sse_m2": 0.00584711611977355},
        "rpe_rad": {"rmse_rad": 0.00675601914381015, "mean_rad": 0.005892967740759686, "median_rad": 0.005305083102858149, "std_rad": 0.0033040468940217726, "max_rad": 0.017158830525014653, "sse_rad2": 0.0053403239765689205},
    }),
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam_drift.txt", "se3", "1f", 785, {
        "ate_m": {"rmse_m": 0.013470118951368286, "mean_m": 0.012024516062202239, "median_m": 0.011183137957357155, "std_m": 0.006070841624836824, "max_m": 0.03475989717409255, "sse_m2": 0.14243362208274868},
        "ate_rad": {"rmse_rad": 0.035913683419093574, "mean_rad": 0.03533764896259921, "median_rad": 0.034922272353697034, "std_rad": 0.006406498460390681, "max_rad": 0.06352364407020247, "sse_rad2": 1.0124872355305983},
        "rpe_m": {"rmse_m": 0.005764378833030759, "mean_m": 0.004815612031956735, "median_m": 0.004138810593404751, "std_m": 0.0031682714669621624, "max_m": 0.020865165925125596, "sse_m2": 0.026050801651263347},
        "rpe_rad": {"rmse_rad": 0.006171720485841649, "mean_rad": 0.00524137065015888, "median_rad": 0.004575192525714374, "std_rad": 0.0032585529707234383, "max_rad": 0.028506179011141806, "sse_rad2": 0.029862664864200264},
    }),
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-ORB_kf_mono.txt", "sim3", "1f", 32, {
        "ate_m": {"rmse_m": 0.009754581898685118, "mean_m": 0.008218698588816626, "median_m": 0.007909070259951256, "std_m": 0.0052540328819240326, "max_m": 0.02792400173407602, "sse_m2": 0.003044859776580971},
        "ate_rad": {"rmse_rad": 0.04139613576856837, "mean_rad": 0.04080462493904182, "median_rad": 0.04186042632478893, "std_rad": 0.006972993629272269, "max_rad": 0.054763417280413645, "sse_rad2": 0.05483648181023185},
        "rpe_m": {"rmse_m": 0.013834917845974098, "mean_m": 0.01205827516547716, "median_m": 0.01114185876756864, "std_m": 0.006782547592054872, "max_m": 0.030228647349587398, "sse_m2": 0.005933553505950429},
        "rpe_rad": {"rmse_rad": 0.01544352773003641, "mean_rad": 0.01374839584700085, "median_rad": 0.011382401410901187, "std_rad": 0.00703449787707504, "max_rad": 0.03036800330737084, "sse_rad2": 0.00739357901120051},
    }),
    ("V102_groundtruth.csv", "V102.txt", "se3", "1f", 798, {
        "ate_m": {"rmse_m": 0.09172711520685745, "mean_m": 0.08152162194619841, "median_m": 0.07791194901949514, "std_m": 0.04204864824739554, "max_m": 0.2558167338139711, "sse_m2": 6.714263204009335},
        "ate_rad": {"rmse_rad": 0.04741660526073717, "mean_rad": 0.040291018997597176, "median_rad": 0.034116167155313924, "std_rad": 0.024999364843688143, "max_rad": 0.17298397053266082, "sse_rad2": 1.7941708946531487},
        "rpe_m": {"rmse_m": 0.015076710159641326, "mean_m": 0.0061069224653804545, "median_m": 0.00418393933605831, "std_m": 0.013784508958960546, "max_m": 0.21740892442745752, "sse_m2": 0.1811638298225521},
        "rpe_rad": {"rmse_rad": 0.006241569587237647, "mean_rad": 0.0015686251502681399, "median_rad": 0.0005764828193765091, "std_rad": 0.006041242094989755, "max_rad": 0.08620451632265398, "sse_rad2": 0.031048881157126958},
    }),
    ("KITTI_00_gt.txt", "KITTI_00_ORB.txt", "none", "100m", 4541, {
        "ate_m": {"rmse_m": 7.790288882656827, "mean_m": 7.01175040166684, "median_m": 6.801631674560281, "std_m": 3.3946954473076767, "max_m": 13.45850880738189, "sse_m2": 275586.9365744946},
        "ate_rad": {"rmse_rad": 0.02809209900464346, "mean_rad": 0.026846044735682965, "median_rad": 0.026503840986244483, "std_rad": 0.008273808587125956, "max_rad": 0.13851647926600827, "sse_rad2": 3.5836029262760603},
        "rpe_m": {"rmse_m": 1.1939759245846355, "mean_m": 1.054477825715355, "median_m": 0.9214941902754695, "std_m": 0.5600491260258809, "max_m": 2.959637959978665, "sse_m2": 51.32082630555847},
        "rpe_rad": {"rmse_rad": 0.0127205812441406, "mean_rad": 0.01085243708796793, "median_rad": 0.009341945930856844, "std_rad": 0.006636097983037908, "max_rad": 0.027510071212431965, "sse_rad2": 0.005825274738796139},
    }),
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam_drift.txt", "none", "1f", 785, {
        "ate_m": {"rmse_m": 0.1341854204892675, "mean_m": 0.12298561737556277, "median_m": 0.12653056052590608, "std_m": 0.053668100307661386, "max_m": 0.249332053412713, "sse_m2": 14.134495751427},
        "ate_rad": {"rmse_rad": 0.6314234199974088, "mean_rad": 0.631390932232237, "median_rad": 0.6312379197351714, "std_rad": 0.006405155433781589, "max_rad": 0.6498623343158032, "sse_rad2": 312.9759952271609},
        "rpe_m": {"rmse_m": 0.00576437883303076, "mean_m": 0.004815612031956733, "median_m": 0.0041388105934044355, "std_m": 0.0031682714669621697, "max_m": 0.02086516592512568, "sse_m2": 0.026050801651263365},
        "rpe_rad": {"rmse_rad": 0.00617172048584165, "mean_rad": 0.005241370650158882, "median_rad": 0.004575192525714371, "std_rad": 0.00325855297072344, "max_rad": 0.028506179011141823, "sse_rad2": 0.029862664864200278},
    }),
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt", "origin", "10f", 785, {
        "ate_m": {"rmse_m": 0.0193679199417015, "mean_m": 0.017348899180007264, "median_m": 0.01586610065781946, "std_m": 0.008609995360631843, "max_m": 0.04217667886684081, "sse_m2": 0.29446631345150454},
        "ate_rad": {"rmse_rad": 0.012060551607591641, "mean_rad": 0.010820373821042836, "median_rad": 0.010050253677584307, "std_rad": 0.005326951797442152, "max_rad": 0.03069605883323569, "sse_rad2": 0.11418367048731434},
        "rpe_m": {"rmse_m": 0.014610132023888821, "mean_m": 0.012477076968475886, "median_m": 0.011981234060699548, "std_m": 0.007601217539196614, "max_m": 0.04315386173025573, "sse_m2": 0.01664956470492601},
        "rpe_rad": {"rmse_rad": 0.012244730138468822, "mean_rad": 0.010974490801853328, "median_rad": 0.010414732364757429, "std_rad": 0.005430834908553507, "max_rad": 0.027817981189301254, "sse_rad2": 0.011694806460786284},
    }),
]  # fmt: skip


@pytest.mark.parametrize(
    ("reference", "estimate", "align", "delta", "matched", "expected"), PAIRS, ids=lambda v: str(v)[:24]
)
def test_figures_equal_those_of_evo(recordings, reference, estimate, align, delta, matched, expected):
    truth, guess = (read_trajectory(recordings / "evo" / name) for name in (reference, estimate))
    result = evaluate(truth, guess, EvaluateParams(align=align, delta=delta)).result
    assert result["matched"] == matched
    for group, statistics in expected.items():
        found = result[group.partition("_")[0]]
        for key, value in statistics.items():
            assert found[key] == pytest.approx(value, rel=1e-9), (group, key)


def test_repeated_stamps_of_published_files_are_counted(recordings):
    truth = read_trajectory(recordings / "evo" / "V102_groundtruth.csv")
    guess = read_trajectory(recordings / "evo" / "V102.txt")
    result = evaluate(truth, guess, EvaluateParams()).result
    assert (result["reference_repeats"], result["estimate_repeats"]) == (0, 4)
