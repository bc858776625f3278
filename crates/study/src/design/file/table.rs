//! Tables of a file as they are defined.

/// Whether a value is the default of its type.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Defines tables: structs that are read, written and described by their keys, and refuse others. A key `name?: Type`
/// may be absent, and is not written where it has the default of its type. In a table of which `Default` is said every
/// key may be absent; its default stands behind the type where it is not that of the type.
macro_rules! tables {
    ($($(#[$about:meta])* pub struct $name:ident $(: $default:ident)? { $($keys:tt)* })*) => {
        $($crate::design::file::table::tables!(@keys [$(#[$about])*] $name [$($default)?] [] [] $($keys)*);)*
    };
    (
        @keys $head:tt $name:ident $default:tt [$($key:tt)*] [$($value:tt)*]
        $(#[$about:meta])* $next:ident?: $type:ty, $($rest:tt)*
    ) => {
        $crate::design::file::table::tables!(
            @keys $head $name $default
            [
                $($key)* $(#[$about])*
                #[serde(default, skip_serializing_if = "crate::design::file::table::is_default")]
                pub $next: $type,
            ]
            [$($value)* $next: <$type>::default(),] $($rest)*
        );
    };
    (
        @keys $head:tt $name:ident $default:tt [$($key:tt)*] [$($value:tt)*]
        $(#[$about:meta])* $next:ident: $type:ty $(= $given:expr)?, $($rest:tt)*
    ) => {
        $crate::design::file::table::tables!(
            @keys $head $name $default
            [$($key)* $(#[$about])* pub $next: $type,]
            [$($value)* $next: $crate::design::file::table::tables!(@value $type $(, $given)?),] $($rest)*
        );
    };
    (@value $type:ty) => { <$type>::default() };
    (@value $type:ty, $given:expr) => { $given };
    (@keys $about:tt $name:ident [] $keys:tt $values:tt) => {
        $crate::design::file::table::tables!(@struct $about [] $name $keys);
    };
    (@struct [$($about:tt)*] [$($default:tt)*] $name:ident [$($key:tt)*]) => {
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        $($about)*
        #[serde(deny_unknown_fields)]
        $($default)*
        pub struct $name { $($key)* }
    };
    (@keys $about:tt $name:ident [Default] $keys:tt [$($value:tt)*]) => {
        $crate::design::file::table::tables!(@struct $about [#[serde(default)]] $name $keys);

        impl Default for $name {
            fn default() -> Self {
                Self { $($value)* }
            }
        }
    };
}
pub(crate) use tables;
