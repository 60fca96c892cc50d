"""Words that an argument may not be called in one of the languages, so that it has the same name in all."""

_C_AND_CUDA = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl const consteval constexpr
constinit const_cast continue co_await co_return co_yield decltype default delete do double dynamic_cast else enum
explicit export extern false final float for friend goto if inline int long mutable namespace new noexcept not not_eq
nullptr operator or or_eq override private protected public register reinterpret_cast requires restrict return short
signed sizeof static static_assert static_cast struct switch template this thread_local throw true try typedef typeid
typename typeof union unsigned using virtual void volatile wchar_t while xor xor_eq
abs acos asin atan atan2 ceil cos cosh div erf erfc exp exp2 floor fma fmax fmin fmod gamma hypot isnan j0 j1 jn ldexp
lgamma log log2 max min modf pow rint round sin sinh sqrt tan tanh tgamma trunc y0 y1 yn
I EOF NULL INFINITY NAN HUGE_VAL
"""
_GLSL = """
active atomic_uint attribute buffer cast centroid coherent common discard external filter fixed flat half highp hvec2
hvec3 hvec4 in inout input interface invariant ivec2 ivec3 ivec4 layout lowp mat2 mat3 mat4 mediump noinline
noperspective out output packed partition patch precise precision readonly resource row_major sample sampler2D shared
smooth subroutine superp uint uniform uvec2 uvec3 uvec4 varying vec2 vec3 vec4 writeonly main
"""
_HLSL = """
AppendStructuredBuffer BlendState Buffer ByteAddressBuffer ConsumeStructuredBuffer DepthStencilState GeometryShader
InputPatch LineStream NULL OutputPatch PixelShader PointStream RasterizerState RenderTargetView SamplerState Texture2D
TriangleStream VertexShader cbuffer clipplanes column_major compile dword export float2 float3 float4 fxgroup
groupshared half2 half3 half4 linear matrix nointerpolation numthreads pass pixelfragment point register sampler
snorm stateblock string tbuffer technique texture triangle unorm unsigned vector vertexfragment clip lerp step
"""
_OSL = """
closure color displacement emit float illuminance illuminate matrix normal output point shader string surface vector
volume P N Ng dPdu dPdv Ps Ci time dtime dPdtime M_PI u v
"""
_WGSL = """
alias array as async atomic await become case cdata co const const_assert continuing crate default demote
demote_to_helper diagnostic discard do dyn enable enum extends f16 f32 fallthrough finally fn from fxgroup get i32 impl
implements import instanceof is itemset let loop macro match mem mod module move mut nil null of override pointer
premerge ptr pub ref regardless require self Self set sizeof stringify super target texture trait type u32 unless
unorm unsafe unsized use var vec2f vec3f vec4f where with yield bitcast select
"""
_OURS = """
f f_cos pdf sample mueller jacobian wi wo u weight delta M y result below
"""

WORDS = frozenset(f"{_C_AND_CUDA}{_GLSL}{_HLSL}{_OSL}{_WGSL}{_OURS}".split())
