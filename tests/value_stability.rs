//! The first outputs of every stream, pinned: a change here changes every published number.
//!
//! An independent implementation of the stream's definition in Python computed the words, and the normal numbers with
//! 40 digits. The pinned bits are within an ulp or two of those.

use asobench::data::{Process, Realisation};
use asobench::plant::{Numerator, nikolov2023};
use asobench::signal::normal::fill_standard_normal;
use asobench::signal::{NoiseFilter, Purpose, RandomSigns, Sequence, stream};
use rand::Rng;

#[test]
fn words() {
    for (purpose, expected) in [
        (
            Purpose::Input,
            [
                0x1e4e_2e48_9aba_d5d1,
                0x0f57_46ed_2849_c906,
                0x96b8_ba4c_08a5_63f6,
                0xe82f_41ac_2a3b_77f1_u64,
            ],
        ),
        (
            Purpose::NoiseDrive,
            [
                0x9e2e_3aea_5329_459c,
                0x4fbf_1844_8470_c92a,
                0x367d_d937_8b79_c476,
                0x1e0c_6114_fc57_c5f3,
            ],
        ),
        (
            Purpose::NoiseStart,
            [
                0x0bb5_6b52_eef7_0bdb,
                0x4e48_836a_1c03_4560,
                0x7eb0_033a_dcb8_3190,
                0x0621_d8a0_e580_7c0f,
            ],
        ),
        (
            Purpose::Plant,
            [
                0xd028_dd8f_721f_b5a6,
                0x4561_de05_eb64_9342,
                0x7664_d48c_fdbc_dc1a,
                0xaaaa_293a_11bc_12cd,
            ],
        ),
        (
            Purpose::InputNoise,
            [
                0x6674_2828_4e9a_cb0e,
                0x1885_0151_2345_49e0,
                0xa918_c8eb_f085_7ad6,
                0x7906_3fe1_75c6_d580,
            ],
        ),
        (
            Purpose::FreshInput,
            [
                0xe4c6_00c5_0552_ac06,
                0xebb0_4737_e6d8_395a,
                0x407e_f642_925d_f89f,
                0xbe5b_1cba_f2f3_ede1,
            ],
        ),
        (
            Purpose::ProcessNoise,
            [
                0x3c85_30f2_0101_2bc2,
                0xc8c2_3ccb_4573_2a5e,
                0xd46f_c5a9_e456_205c,
                0xf045_ca15_3030_b99b,
            ],
        ),
        (
            Purpose::InitialState,
            [
                0x72c5_23ce_fdaf_390f,
                0xccf2_4f59_bbc0_7257,
                0x8b6b_b8ae_b2f2_7a4e,
                0x9dde_9321_3bae_bd55,
            ],
        ),
        (
            Purpose::Program,
            [
                0x44f5_ad68_0be7_212c,
                0xbab9_6cf7_bb33_4e8d,
                0xc37c_7796_b63a_c3fc,
                0x45fa_54aa_48b1_538d,
            ],
        ),
    ] {
        let mut words = stream(2023, 7, purpose);
        assert_eq!([(); 4].map(|()| words.next_u64()), expected, "{purpose:?}");
    }
}

#[test]
fn normals() {
    let exact = [
        -1.3462630026990003,
        1.6096428896922836,
        1.8209081317149522,
        0.8349514975039936,
        -2.3216928572696145,
        0.5401238506659019,
    ];
    let mut z = [0.0; 6];
    fill_standard_normal(&mut stream(2023, 7, Purpose::NoiseDrive), &mut z);
    for (z, exact) in z.iter().zip(exact) {
        assert!((z / exact - 1.0).abs() < 3.0 * f64::EPSILON, "{z:?} for {exact:?}");
    }
    assert_eq!(z.map(f64::to_bits), PINNED_NORMALS, "{:#x?}", z.map(f64::to_bits));
}

const PINNED_NORMALS: [u64; 6] = [
    0xbff5_8a4b_1306_82ee,
    0x3ff9_c118_e717_7a08,
    0x3ffd_2270_90ab_c766,
    0x3fea_b7ec_33f0_d3ff,
    0xc002_92d3_b46a_a369,
    0x3fe1_48b1_d04c_c9d1,
];

/// A whole realisation: input, stationary draw, filter, simulation, noise level. The checksum combines the bits of y;
/// it holds on every machine.
#[test]
fn a_realisation() {
    let plant = nikolov2023(Numerator::default());
    let noise = NoiseFilter::new(&[1.0], &plant.denominator()).unwrap();
    let input = RandomSigns {
        amplitude: 10.0,
        sequence: Sequence::Independent,
    };
    let process = Process::new(plant, vec![1.0; 6], input, noise, Default::default()).unwrap();
    let mut record = Realisation::default();
    process.realise(2023, 7, 10.018, 98, 400, &mut record);
    let fold = |values: &[f64]| {
        let bits = values.iter().map(|value| value.to_bits());
        bits.fold(0_u64, |sum, bits| {
            sum.rotate_left(5).wrapping_mul(0x0100_0000_01b3) ^ bits
        })
    };
    let found = [fold(&record.u), fold(&record.f), fold(&record.y0), fold(&record.y)];
    assert_eq!(found, PINNED_REALISATION, "{found:#x?}");
}

const PINNED_REALISATION: [u64; 4] = [
    0xbf31_fdfc_65be_af0e,
    0xd896_86fc_677c_e65c,
    0xb661_625a_dc9d_eb8f,
    0xba3f_16d7_704b_3a66,
];
