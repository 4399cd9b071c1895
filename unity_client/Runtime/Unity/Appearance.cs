using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;
using Shader = UnityEngine.Shader;

namespace HapticVLM
{
    /// <summary>Reads the names, surfaces and shader parameters of an object for the service.</summary>
    internal static class Appearance
    {
        const int TransparentQueue = 3000; // RenderQueue.Transparent

        static readonly int Metallic = Shader.PropertyToID("_Metallic");
        static readonly int MetallicMap = Shader.PropertyToID("_MetallicGlossMap");
        static readonly int Smoothness = Shader.PropertyToID("_Smoothness");
        static readonly int Glossiness = Shader.PropertyToID("_Glossiness");
        static readonly int[] BaseMaps = { Shader.PropertyToID("_BaseMap"), Shader.PropertyToID("_BaseColorMap"), Shader.PropertyToID("_MainTex") };
        static readonly int BaseColor = Shader.PropertyToID("_BaseColor");
        static readonly int OldColor = Shader.PropertyToID("_Color");

        /// <summary>
        /// Reads name, shader parameters and surfaces of an object into its description. Returns its surfaces; `keeps`
        /// copies its meshes, so that a touch can name one of them, and states the texture maps whose hash is known.
        /// </summary>
        public static ObjectSurfaces Read(HapticObject of, bool keeps, ref SceneObject stated)
        {
            var surfaces = new ObjectSurfaces(of, keeps);
            stated.Name = Name(of.gameObject);
            if (surfaces.Count == 0) return surfaces;
            stated.Shader = Parameters(surfaces.MaterialOf(0));
            stated.Surfaces = new List<ObjectSurface>();
            for (int i = 0; i < surfaces.Count; i++)
            {
                Material material = surfaces.MaterialOf(i);
                TextureMap map = keeps ? surfaces.MapOf(i) : null;
                stated.Surfaces.Add(new ObjectSurface
                {
                    Name = NameOf(material),
                    Shader = i == 0 ? null : Parameters(material),
                    Texture = map == null ? null : map.Hash,
                });
            }
            return surfaces;
        }

        /// <summary>Joins the names of collider material and object, which is the noun, behind those of its parents.</summary>
        public static string Name(GameObject of)
        {
            var collider = of.GetComponentInChildren<Collider>();
            var surface = collider == null ? null : collider.sharedMaterial;
            return PathOf(of.transform, surface == null ? of.name : surface.name + " " + of.name);
        }

        /// <summary>Returns a name behind those of the parents, as many as the service reads.</summary>
        public static string PathOf(Transform of, string name)
        {
            for (Transform parent = of.parent; parent != null; parent = parent.parent)
            {
                string path = parent.name + "/" + name;
                if (path.Length > SceneObject.NameMaxLength) break;
                name = path;
            }
            return WireText.Within(name, SceneObject.NameMaxLength);
        }

        /// <summary>Returns the name of a material behind that of its base colour map, which is read if the material's says nothing.</summary>
        public static string NameOf(Material material)
        {
            Texture map = MapOf(material);
            string name = map == null ? material.name : map.name + "/" + material.name;
            return WireText.Within(name.Length > ObjectSurface.NameMaxLength ? material.name : name, ObjectSurface.NameMaxLength);
        }

        /// <summary>Returns the base-colour map of a material, or null.</summary>
        public static Texture MapOf(Material material)
        {
            Texture map = null;
            for (int i = 0; i < BaseMaps.Length && map == null; i++)
            {
                if (material.HasProperty(BaseMaps[i])) map = material.GetTexture(BaseMaps[i]);
            }
            return map;
        }

        static HapticVLM.Wire.Shader? Parameters(Material material)
        {
            var shader = default(HapticVLM.Wire.Shader);
            bool hasMap = material.HasProperty(MetallicMap) && material.GetTexture(MetallicMap) != null;
            if (!hasMap) // with a map the numeric values have no effect
            {
                shader.Metallic = Share(material, Metallic);
                double? smooth = Share(material, Smoothness) ?? Share(material, Glossiness);
                if (smooth != null) shader.Roughness = 1.0 - smooth.Value;
            }
            int key = material.HasProperty(BaseColor) ? BaseColor : OldColor;
            if (material.HasProperty(key)) ReadColor(material, key, ref shader);
            return shader;
        }

        static void ReadColor(Material material, int key, ref HapticVLM.Wire.Shader shader)
        {
            Color color = material.GetColor(key);
            shader.BaseColor = new List<double> { Clamped(color.r), Clamped(color.g), Clamped(color.b) };
            if (material.renderQueue >= TransparentQueue) shader.Opacity = Clamped(color.a);
        }

        static double? Share(Material material, int key)
        {
            return material.HasProperty(key) ? Clamped(material.GetFloat(key)) : (double?)null;
        }

        static double Clamped(float value)
        {
            return value > 0f ? Math.Min(value, 1.0) : 0.0; // HDR colours exceed 1
        }
    }
}
