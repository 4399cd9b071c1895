using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;
using Shader = UnityEngine.Shader;

namespace HapticVLM
{
    /// <summary>Reads off a game object what it looks like by name and by shader parameters.</summary>
    internal static class Appearance
    {
        const int TransparentQueue = 3000; // RenderQueue.Transparent

        static readonly int Metallic = Shader.PropertyToID("_Metallic");
        static readonly int MetallicMap = Shader.PropertyToID("_MetallicGlossMap");
        static readonly int Smoothness = Shader.PropertyToID("_Smoothness");
        static readonly int Glossiness = Shader.PropertyToID("_Glossiness");
        static readonly int BaseColor = Shader.PropertyToID("_BaseColor");
        static readonly int OldColor = Shader.PropertyToID("_Color");

        public static void Read(GameObject of, ref SceneObject stated)
        {
            var renderer = of.GetComponentInChildren<Renderer>();
            Material material = renderer == null ? null : renderer.sharedMaterial;
            stated.Name = Name(of, material);
            if (material != null) stated.Shader = Parameters(material);
        }

        /// <summary>Object, collider material, renderer material: the service gives the last word most weight.</summary>
        static string Name(GameObject of, Material material)
        {
            string name = of.name;
            var collider = of.GetComponentInChildren<Collider>();
            var surface = collider == null ? null : collider.sharedMaterial;
            if (surface != null) name += " " + surface.name;
            if (material != null) name += " " + material.name;
            return WireText.Within(name, SceneObject.NameMaxLength);
        }

        static HapticVLM.Wire.Shader? Parameters(Material material)
        {
            var found = default(HapticVLM.Wire.Shader);
            bool hasMap = material.HasProperty(MetallicMap) && material.GetTexture(MetallicMap) != null;
            if (!hasMap) // with a map the numbers are not what is seen
            {
                found.Metallic = Share(material, Metallic);
                double? smooth = Share(material, Smoothness) ?? Share(material, Glossiness);
                if (smooth != null) found.Roughness = 1.0 - smooth.Value;
            }
            int key = material.HasProperty(BaseColor) ? BaseColor : OldColor;
            if (material.HasProperty(key)) ReadColor(material, key, ref found);
            return found;
        }

        static void ReadColor(Material material, int key, ref HapticVLM.Wire.Shader found)
        {
            Color color = material.GetColor(key);
            found.BaseColor = new List<double> { Clamped(color.r), Clamped(color.g), Clamped(color.b) };
            if (material.renderQueue >= TransparentQueue) found.Transmission = 1.0 - Clamped(color.a);
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
